#include "render/picture/offscreen.h"

#include <GL/osmesa.h>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <unistd.h>

#ifdef __SANITIZE_ADDRESS__
// OSMesaDestroyContext of Mesa 22.3 does not free the context's record of its colour buffer, some 230 bytes.
// Leaks of our own are still reported. The sanitizer looks the function up by its name, which this library
// hides.
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions() {
    return "leak:libOSMesa";
}
#endif

namespace render {

struct OffscreenContext::State {
    OSMesaContext context = nullptr;
    // OSMesa requires a colour buffer of its own; drawing goes to framebuffer objects.
    std::uint32_t buffer[16 * 16] = {};
};

namespace {

/// Whether an earlier context of this program was made by the process that this one was forked from.
bool forked() {
    static const pid_t first = getpid();
    return getpid() != first;
}

void refuse_if_forked() {
    if (forked())
        throw std::runtime_error(
            "images cannot be made in a process that was forked from one that had made some, because the "
            "rasteriser's threads are not there; start the process anew ('spawn' in Python)");
}

}  // namespace

OffscreenContext::OffscreenContext() : state_(nullptr) {
    refuse_if_forked();
    // 4.5 core is the best llvmpipe offers; 3.3 is all that is needed.
    constexpr int versions[][2] = {{4, 5}, {3, 3}};
    OSMesaContext context = nullptr;
    for (const auto& version : versions) {
        const int attributes[] = {OSMESA_FORMAT,
                                  OSMESA_RGBA,
                                  OSMESA_DEPTH_BITS,
                                  0,
                                  OSMESA_PROFILE,
                                  OSMESA_CORE_PROFILE,
                                  OSMESA_CONTEXT_MAJOR_VERSION,
                                  version[0],
                                  OSMESA_CONTEXT_MINOR_VERSION,
                                  version[1],
                                  0};
        context = OSMesaCreateContextAttribs(attributes, nullptr);
        if (context != nullptr) break;
    }
    if (context == nullptr) {
        throw std::runtime_error(
            "OSMesa gives no OpenGL 3.3 core context: is libosmesa6 installed and whole?");
    }
    state_ = new State;
    state_->context = context;
}

OffscreenContext::~OffscreenContext() {
    if (forked()) return;
    OSMesaDestroyContext(state_->context);
    delete state_;
}

OffscreenContext::Use::Use(const State& state) {
    refuse_if_forked();
    // OSMesa takes a buffer that it may write to.
    auto* buffer = const_cast<std::uint32_t*>(state.buffer);
    if (OSMesaMakeCurrent(state.context, buffer, GL_UNSIGNED_BYTE, 16, 16) != GL_TRUE) {
        throw std::runtime_error("OSMesa could not make its context current");
    }
}
OffscreenContext::Use::~Use() {
    OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0);
}

OffscreenContext::Use OffscreenContext::use() const {
    return Use(*state_);
}

OffscreenContext::Function OffscreenContext::function(const char* name) const {
    const Function address = OSMesaGetProcAddress(name);
    if (address == nullptr) throw std::runtime_error(std::string("OSMesa has no function ") + name);
    return address;
}

}  // namespace render
