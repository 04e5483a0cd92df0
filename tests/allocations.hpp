// Counts what this thread allocates with operator new since a watch began. The program is to be linked with
// allocations.cpp, which replaces operator new and delete.
#pragma once

#include <cstddef>

namespace parhelion::test {

struct Allocations {
  std::size_t count = 0;
  std::size_t largest = 0;
};
inline thread_local Allocations allocations;

class AllocationWatch {
 public:
  AllocationWatch() { allocations = {}; }
  std::size_t count() const { return allocations.count; }
  std::size_t largest() const { return allocations.largest; }
};

}  // namespace parhelion::test
