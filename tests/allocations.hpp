#pragma once

#include <cstdlib>
#include <new>

// Counts every allocation of the program; included by one of its files.
namespace trundle::test {
inline std::size_t allocations = 0;
}

// The replaced operators are malloc and free on purpose; g++ 12 says so where it inlines only one of a pair.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

void* operator new(std::size_t size) {
  ++trundle::test::allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
