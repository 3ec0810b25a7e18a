#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <array>
#include <cstring>

#include "render/picture/gl_source.h"

#ifdef __SANITIZE_ADDRESS__
// The display and what the driver keeps of it live as long as the process does.
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions() {
    return "leak:libEGL\nleak:libgallium\nleak:swrast_dri";
}
#endif

namespace render::gl_source {

const char* const name = "EGL";
const char* const package = "libegl1 libegl-mesa0 libgl1-mesa-dri";
const char* const shader_header = "#version 330 core\n";

namespace {

template <class F>
F extension(const char* function) {
    return reinterpret_cast<F>(eglGetProcAddress(function));
}

/// Mesa's rasteriser on the processor, whatever graphics the machine has: pixels must not depend on it.
EGLDisplay software_display() {
    const auto devices = extension<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
    const auto text = extension<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
    const auto display = extension<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
    if (!devices || !text || !display) return EGL_NO_DISPLAY;
    std::array<EGLDeviceEXT, 32> found = {};
    EGLint count = 0;
    if (!devices(static_cast<EGLint>(found.size()), found.data(), &count)) return EGL_NO_DISPLAY;
    for (int k = 0; k < count; ++k) {
        const char* abilities = text(found[static_cast<std::size_t>(k)], EGL_EXTENSIONS);
        if (!abilities || !std::strstr(abilities, "EGL_MESA_device_software")) continue;
        const EGLDisplay made = display(EGL_PLATFORM_DEVICE_EXT, found[static_cast<std::size_t>(k)], nullptr);
        if (made != EGL_NO_DISPLAY && eglInitialize(made, nullptr, nullptr)) return made;
    }
    return EGL_NO_DISPLAY;
}

/// One for all contexts of the process, which is never taken down.
EGLDisplay the_display() {
    static const EGLDisplay display = software_display();
    return display;
}

}  // namespace

bool adds_floats() {
    return true;
}

void* make_context(int major, int minor) {
    if (the_display() == EGL_NO_DISPLAY || !eglBindAPI(EGL_OPENGL_API)) return nullptr;
    const EGLint wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglChooseConfig(the_display(), wanted, &config, 1, &count) || count == 0) return nullptr;
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 major,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 minor,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_NONE};
    return eglCreateContext(the_display(), config, EGL_NO_CONTEXT, attributes);
}

void destroy_context(void* context) {
    eglDestroyContext(the_display(), context);
}

bool take(void* context) {
    return eglBindAPI(EGL_OPENGL_API) &&
           eglMakeCurrent(the_display(), EGL_NO_SURFACE, EGL_NO_SURFACE, context);
}

void leave() {
    eglMakeCurrent(the_display(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

Function function(const char* name) {
    return eglGetProcAddress(name);
}

}  // namespace render::gl_source
