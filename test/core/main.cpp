#include <gtest/gtest.h>

int main(int argc, char** argv) {  // catkin does not link gtest_main everywhere
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
