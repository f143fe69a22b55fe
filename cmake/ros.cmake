# Nodelets, launch files and what else needs ROS.
install(DIRECTORY launch config
  DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION} OPTIONAL)
