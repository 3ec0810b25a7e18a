#pragma once
/// OpenGL without a window. To be included in source files only: it includes OpenGL's headers.

#define GL_GLEXT_PROTOTYPES  // declared for decltype below, never linked
#include <GL/gl.h>
#include <GL/glext.h>
#include <stdexcept>
#include <string>

#include "render/picture/gl_functions.h"
#include "render/picture/gl_source.h"
#include "render/picture/offscreen.h"

namespace render {

/// A context of its own and the GL functions used for drawing here, named without "gl".
struct GlContext {
    OffscreenContext context;

#define RENDER_GL_MEMBER(name) decltype(&::gl##name) name = nullptr;
    RENDER_GL_FUNCTIONS(RENDER_GL_MEMBER)
#undef RENDER_GL_MEMBER

    /// Throws std::runtime_error when there is no context. Every call of GL needs context.use().
    GlContext() {
#define RENDER_GL_LOAD(name) name = reinterpret_cast<decltype(name)>(context.function("gl" #name));
        RENDER_GL_FUNCTIONS(RENDER_GL_LOAD)
#undef RENDER_GL_LOAD
    }

    /// Of shaders without the line of their version. Throws std::runtime_error when OpenGL refuses those of
    /// `what`.
    GLuint linked_program(const char* vertex_shader, const char* fragment_shader, const char* what) const {
        const GLuint program = CreateProgram();
        const auto attach = [&](GLenum kind, const char* text) {
            const GLuint shader = CreateShader(kind);
            const char* const parts[] = {gl_source::shader_header, text};
            ShaderSource(shader, 2, parts, nullptr);
            CompileShader(shader);
            AttachShader(program, shader);
            DeleteShader(shader);
        };
        attach(GL_VERTEX_SHADER, vertex_shader);
        attach(GL_FRAGMENT_SHADER, fragment_shader);
        LinkProgram(program);
        GLint linked = GL_FALSE;
        GetProgramiv(program, GL_LINK_STATUS, &linked);
        if (linked != GL_TRUE)
            throw std::runtime_error(std::string(what) + "'s shader was refused by OpenGL");
        return program;
    }

    /// Throws std::runtime_error.
    void require_no_error(const char* doing) const {
        const GLenum error = GetError();
        if (error != GL_NO_ERROR)
            throw std::runtime_error("OpenGL error " + std::to_string(error) + " while " + doing);
    }
};

}  // namespace render
