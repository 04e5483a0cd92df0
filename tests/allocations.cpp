#include "tests/allocations.hpp"

#include <algorithm>
#include <cstdlib>
#include <new>

void* operator new(std::size_t size) {
  auto& seen = parhelion::test::allocations;
  ++seen.count;
  seen.largest = std::max(seen.largest, size);
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
