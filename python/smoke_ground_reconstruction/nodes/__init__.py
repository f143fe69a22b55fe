"""rospy nodes that run the NumPy reference in the place of a nodelet: same name, topics, parameters
and diagnostics. Slower, and edited without a build."""
