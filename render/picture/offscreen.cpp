#include "render/picture/offscreen.h"

#include <stdexcept>
#include <string>

#include "render/picture/gl_source.h"

namespace render {

struct OffscreenContext::State {
    void* context = nullptr;
};

OffscreenContext::OffscreenContext() : state_(nullptr) {
    gl_source::require_usable(gl_source::Moment::First);
    // 4.5 core is the best llvmpipe offers; 3.3 is all that is needed.
    void* context = gl_source::make_context(4, 5);
    if (!context) context = gl_source::make_context(3, 3);
    if (!context)
        throw std::runtime_error(std::string(gl_source::name) +
                                 " gives no OpenGL 3.3 core context in software: are these installed and "
                                 "whole: " +
                                 gl_source::package + "?");
    gl_source::made();
    state_ = new State{context};
}

OffscreenContext::~OffscreenContext() {
    if (!gl_source::is_of_this_process()) return;
    gl_source::destroy_context(state_->context);
    delete state_;
}

OffscreenContext::Use::Use(const State& state) {
    gl_source::require_usable(gl_source::Moment::Use);
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
