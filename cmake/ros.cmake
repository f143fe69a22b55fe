# Nodelets, launch files and what else needs ROS.
if(NOT SMOKE_GROUND_PCL)
  message(FATAL_ERROR "The nodelets need PCL; without it build with -DSMOKE_GROUND_WITH_ROS=OFF")
endif()

# --- adapters: messages to views and back, parameters, laziness, tf ---------------------------------
smoke_ground_add_library(ros
  src/ros/cloud_conversions.cpp
  src/ros/cut_cloud.cpp
  src/ros/fault_log.cpp
  src/ros/floor_markers.cpp
  src/ros/latency_log.cpp
  src/ros/lazy_nodelet.cpp
  src/ros/mounting_source.cpp
  src/ros/param_conversions.cpp
  src/ros/room_findings.cpp
  src/ros/scan_layout.cpp
  src/ros/scan_queue.cpp
  src/ros/sensor_models.cpp
  src/ros/stage_health.cpp
  src/ros/stage_timing.cpp
  src/ros/strange_params.cpp
  src/ros/surface_conversions.cpp)
add_dependencies(${PROJECT_NAME}_ros
  ${PROJECT_NAME}_gencfg ${PROJECT_NAME}_generate_messages_cpp ${catkin_EXPORTED_TARGETS})
target_include_directories(${PROJECT_NAME}_ros PUBLIC
  $<BUILD_INTERFACE:${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_INCLUDE_DESTINATION}>)
target_include_directories(${PROJECT_NAME}_ros SYSTEM PUBLIC ${catkin_INCLUDE_DIRS})
target_link_libraries(${PROJECT_NAME}_ros
  PUBLIC ${PROJECT_NAME}_core ${catkin_LIBRARIES} PRIVATE Eigen3::Eigen)

# --- nodelets ---------------------------------------------------------------------------------------
smoke_ground_add_library(nodelets
  src/nodelets/denoiser_nodelet.cpp
  src/nodelets/latency_probe_nodelet.cpp
  src/nodelets/reconstructor_nodelet.cpp
  src/nodelets/segmenter_nodelet.cpp)
target_link_libraries(${PROJECT_NAME}_nodelets PRIVATE ${PROJECT_NAME}_ros ${PROJECT_NAME}_pcl)

add_executable(standalone src/nodelets/standalone.cpp)
target_include_directories(standalone SYSTEM PRIVATE ${catkin_INCLUDE_DIRS})
target_link_libraries(standalone PRIVATE smoke_ground_options ${catkin_LIBRARIES})
add_dependencies(standalone ${PROJECT_NAME}_nodelets)
install(TARGETS standalone RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

install(FILES nodelets.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(DIRECTORY launch config rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
catkin_install_python(PROGRAMS scripts/denoiser_node scripts/reconstructor_node
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

install(PROGRAMS scripts/smoke_ground DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

if(SMOKE_GROUND_WITH_TESTS AND CATKIN_ENABLE_TESTING)
  add_subdirectory(test/nodelets)
  find_package(roslaunch REQUIRED)
  roslaunch_add_file_check(launch/ground_reconstruction.launch)
endif()
