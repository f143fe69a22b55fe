# Nodelets, launch files and what else needs ROS.
install(DIRECTORY launch config
  DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION} OPTIONAL)
install(PROGRAMS scripts/smoke_ground DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
