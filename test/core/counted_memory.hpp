#pragma once

#include <cstddef>

/// What operator new has handed out so far. A program that links counted_memory.cpp counts.
struct CountedMemory {
  std::size_t allocations;
  std::size_t bytes;
};

CountedMemory countedMemory();
