# The part of a catkin package that must stand before its first target: dependencies, messages,
# dynamic_reconfigure, catkin_package().
find_package(catkin REQUIRED COMPONENTS
  diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs message_filters
  message_generation nav_msgs nodelet pluginlib roscpp sensor_msgs std_msgs tf2_ros
  visualization_msgs)

catkin_python_setup()
add_message_files(FILES FloorBoundary.msg Timing.msg)
generate_messages(DEPENDENCIES geometry_msgs std_msgs)
generate_dynamic_reconfigure_options(cfg/Denoiser.cfg cfg/Reconstructor.cfg cfg/Segmenter.cfg)

set(SMOKE_GROUND_EXPORTED_LIBRARIES ${PROJECT_NAME}_core)
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES ${PROJECT_NAME}_core
  CATKIN_DEPENDS
    diagnostic_updater dynamic_reconfigure geometry_msgs message_filters message_runtime nav_msgs
    nodelet roscpp sensor_msgs std_msgs tf2_ros visualization_msgs
  DEPENDS EIGEN3)

set(SMOKE_GROUND_PYTHON_DIR ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_PYTHON_DESTINATION})
set(SMOKE_GROUND_INSTALL_LIB ${CATKIN_PACKAGE_LIB_DESTINATION})
set(SMOKE_GROUND_INSTALL_INCLUDE ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
set(SMOKE_GROUND_INSTALL_PYTHON ${CATKIN_PACKAGE_PYTHON_DESTINATION})
