#include <GL/osmesa.h>

#include "render/picture/gl_source.h"

#ifdef __SANITIZE_ADDRESS__
// OSMesaDestroyContext of Mesa 22.3 does not free the context's record of its colour buffer, some 230 bytes.
// Leaks of our own are still reported. The sanitizer looks the function up by its name, which this library
// hides.
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions() {
    return "leak:libOSMesa";
}
#endif

namespace render::gl_source {

const char* const name = "OSMesa";
const char* const package = "libosmesa6";
const char* const shader_header = "#version 330 core\n";

namespace {

constexpr int side = 16;  // of the colour buffer that OSMesa asks for, and that nothing is drawn to [pixels]

struct Context {
    OSMesaContext context;
    unsigned buffer[side * side];
};

}  // namespace

bool adds_floats() {
    return true;
}

void* make_context(int major, int minor) {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              0,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              major,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              minor,
                              0};
    const OSMesaContext made = OSMesaCreateContextAttribs(attributes, nullptr);
    return made ? new Context{made, {}} : nullptr;
}

void destroy_context(void* context) {
    OSMesaDestroyContext(static_cast<Context*>(context)->context);
    delete static_cast<Context*>(context);
}

bool take(void* context) {
    auto& taken = *static_cast<Context*>(context);
    return OSMesaMakeCurrent(taken.context, taken.buffer, GL_UNSIGNED_BYTE, side, side) == GL_TRUE;
}

void leave() {
    OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0);
}

Function function(const char* name) {
    return OSMesaGetProcAddress(name);
}

}  // namespace render::gl_source
