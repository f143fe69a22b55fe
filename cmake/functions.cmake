# smoke_ground_add_library(NAME sources...): the library smoke_ground_reconstruction_NAME with the
# project's flags and include directory, installed where catkin's rules say.
function(smoke_ground_add_library name)
  set(target ${PROJECT_NAME}_${name})
  add_library(${target} SHARED ${ARGN})
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:include>)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:smoke_ground_options>)
  install(TARGETS ${target}
    ARCHIVE DESTINATION ${SMOKE_GROUND_INSTALL_LIB}
    LIBRARY DESTINATION ${SMOKE_GROUND_INSTALL_LIB})
endfunction()

# smoke_ground_add_gtest(NAME LIBRARIES... SOURCES...): one gtest program, under catkin's rules where
# ROS is built (target `tests`, results in test_results/), else as a plain ctest.
function(smoke_ground_add_gtest name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  if(SMOKE_GROUND_ROS)
    catkin_add_gtest(${name} ${ARG_SOURCES})
    target_link_libraries(${name} ${ARG_LIBRARIES} smoke_ground_options)
  else()
    add_executable(${name} ${ARG_SOURCES})
    target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} smoke_ground_options GTest::GTest)
    add_test(NAME ${name} COMMAND ${name})
  endif()
endfunction()

# smoke_ground_fingerprint(VARIABLE FILES...): hash of the files and of the compiler and its flags.
# A changed file configures anew.
function(smoke_ground_fingerprint variable)
  string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
  set(text "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_SYSTEM_PROCESSOR}")
  string(APPEND text " ${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${type}}")
  foreach(file ${ARGN})
    file(SHA256 ${file} digest)
    string(APPEND text " ${digest}")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  endforeach()
  string(SHA256 digest "${text}")
  set(${variable} ${digest} PARENT_SCOPE)
endfunction()

# smoke_ground_compile_in(TARGET FILE.yaml NAME.inc): the numbers of a flat YAML file, one a line, as
# an initializer that TARGET's sources include by NAME; made anew whenever the file changes.
function(smoke_ground_compile_in target file name)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/compiled_in)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(STRINGS ${file} lines REGEX "^[a-z]")
  set(text "")
  foreach(line ${lines})
    string(REGEX REPLACE "^([a-z0-9_]+): *(.*)$" "\\2,  // \\1\n" entry "${line}")
    string(APPEND text "${entry}")
  endforeach()
  file(WRITE ${folder}/${name}.new "${text}")
  configure_file(${folder}/${name}.new ${folder}/${name} COPYONLY)
  target_include_directories(${PROJECT_NAME}_${target} PRIVATE ${folder})
endfunction()
