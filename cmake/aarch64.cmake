# Toolchain for the robot's processor (ARMv8), with an emulator for the tests. Needs
# g++-aarch64-linux-gnu and qemu-user-static; serves the ROS-free core.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L /usr/aarch64-linux-gnu -cpu cortex-a76)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
