// Counts what this thread allocates while a watch lives. Include in one source file of a test program only:
// it defines operator new and delete.
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
