/// OpenGL of a browser: WebGL 2 on a canvas that nobody sees.

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include <cstring>
#include <emscripten.h>
#include <emscripten/html5.h>
#include <emscripten/html5_webgl.h>
#include <stdexcept>

#include "render/picture/gl_functions.h"
#include "render/picture/gl_source.h"

/// Of the panel, which a page draws itself; WebGL has none.
extern "C" void glDrawElementsBaseVertex(GLenum, GLsizei, GLenum, const void*, GLint) {}

namespace render::gl_source {

const char* const name = "This browser";
const char* const package =
    "a browser with WebGL 2 and its extensions EXT_color_buffer_float and EXT_float_blend";
const char* const shader_header = "#version 300 es\nprecision highp float;\nprecision highp int;\n";

namespace {

// clang-format off
EM_JS(void, make_canvas, (), { specialHTMLTargets["!lengths"] = new OffscreenCanvas(1, 1); });
// clang-format on

/// WebGL takes what it does not know for an error, and has no multisampling of float targets to switch off.
void disable(GLenum what) {
    if (what != GL_MULTISAMPLE) glDisable(what);
}

}  // namespace

bool adds_floats() {
    static const bool adds = [] {
        void* const context = make_context(3, 3);
        if (context) destroy_context(context);
        return context != nullptr;
    }();
    return adds;
}

void* make_context(int, int) {
    make_canvas();
    EmscriptenWebGLContextAttributes wanted;
    emscripten_webgl_init_context_attributes(&wanted);
    wanted.majorVersion = 2;
    wanted.alpha = wanted.depth = wanted.stencil = wanted.antialias = false;
    wanted.powerPreference = EM_WEBGL_POWER_PREFERENCE_HIGH_PERFORMANCE;
    // OpenGL in software is no faster than the engine's own rasteriser, and less exact.
    wanted.failIfMajorPerformanceCaveat = true;
    wanted.enableExtensionsByDefault = false;
    const EMSCRIPTEN_WEBGL_CONTEXT_HANDLE context = emscripten_webgl_create_context("!lengths", &wanted);
    if (context <= 0) return nullptr;
    if (!emscripten_webgl_enable_extension(context, "EXT_color_buffer_float") ||
        !emscripten_webgl_enable_extension(context, "EXT_float_blend")) {
        emscripten_webgl_destroy_context(context);
        return nullptr;
    }
    return reinterpret_cast<void*>(context);
}

void destroy_context(void* context) {
    emscripten_webgl_destroy_context(reinterpret_cast<EMSCRIPTEN_WEBGL_CONTEXT_HANDLE>(context));
}

bool take(void* context) {
    return emscripten_webgl_make_context_current(
               reinterpret_cast<EMSCRIPTEN_WEBGL_CONTEXT_HANDLE>(context)) == EMSCRIPTEN_RESULT_SUCCESS;
}

void leave() {}

void require_usable(Moment) {}
void made() {}
bool is_of_this_process() {
    return true;
}

Function function(const char* name) {
    if (std::strcmp(name, "glDisable") == 0) return reinterpret_cast<Function>(disable);
#define FOUND(known) \
    if (std::strcmp(name, "gl" #known) == 0) return reinterpret_cast<Function>(gl##known);
    RENDER_GL_FUNCTIONS(FOUND)
#undef FOUND
    return nullptr;
}

}  // namespace render::gl_source
