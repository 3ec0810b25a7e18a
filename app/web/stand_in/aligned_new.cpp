/// Memory at multiples of 16 bytes, as other systems give it: Eigen adds numbers up in pairs from the first
/// such place on, so that a sum would have other last digits than there.

#include <cstdlib>
#include <malloc.h>
#include <new>

void* operator new(std::size_t bytes) {
    if (void* const made = memalign(16, bytes > 0 ? bytes : 1)) return made;
    throw std::bad_alloc();
}
void* operator new[](std::size_t bytes) {
    return operator new(bytes);
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
    return memalign(16, bytes > 0 ? bytes : 1);
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
    return memalign(16, bytes > 0 ? bytes : 1);
}
void operator delete(void* memory) noexcept {
    std::free(memory);
}
void operator delete[](void* memory) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
    std::free(memory);
}
