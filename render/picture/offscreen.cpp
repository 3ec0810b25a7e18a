#include "render/picture/offscreen.h"

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <unistd.h>

#include "render/picture/gl_source.h"

namespace render {

struct OffscreenContext::State {
    void* context = nullptr;
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

/// To be called when a context was made. At the end of a process that was forked since, the rasteriser would
/// wait for ever for its threads, so such a process ends before the rasteriser is asked.
void end_forks_early() {
    static const int once = on_exit(
        [](int status, void*) {
            if (!forked()) return;
            std::fflush(nullptr);
            _exit(status);
        },
        nullptr);
    static_cast<void>(once);
}

}  // namespace

OffscreenContext::OffscreenContext() : state_(nullptr) {
    refuse_if_forked();
    // 4.5 core is the best llvmpipe offers; 3.3 is all that is needed.
    void* context = gl_source::make_context(4, 5);
    if (!context) context = gl_source::make_context(3, 3);
    if (!context)
        throw std::runtime_error(std::string(gl_source::name) +
                                 " gives no OpenGL 3.3 core context in software: are these installed and "
                                 "whole: " +
                                 gl_source::package + "?");
    end_forks_early();
    state_ = new State{context};
}

OffscreenContext::~OffscreenContext() {
    if (forked()) return;
    gl_source::destroy_context(state_->context);
    delete state_;
}

OffscreenContext::Use::Use(const State& state) {
    refuse_if_forked();
    if (!gl_source::take(state.context))
        throw std::runtime_error(std::string(gl_source::name) + " could not make its context current");
}

OffscreenContext::Use::~Use() {
    gl_source::leave();
}

OffscreenContext::Use OffscreenContext::use() const {
    return Use(*state_);
}

OffscreenContext::Function OffscreenContext::function(const char* name) const {
    const Function address = gl_source::function(name);
    if (!address) throw std::runtime_error(std::string(gl_source::name) + " has no function " + name);
    return address;
}

}  // namespace render
