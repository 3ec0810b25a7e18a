#pragma once
/// OpenGL of the window, found through GLFW: the gl functions that the program is linked with belong to
/// OSMesa.

#define GLFW_INCLUDE_NONE
#include <GL/glcorearb.h>
#include <GLFW/glfw3.h>

namespace app {

#define SELDINGER_GL_FUNCTIONS(X)                                \
    X(PFNGLACTIVETEXTUREPROC, ActiveTexture)                     \
    X(PFNGLATTACHSHADERPROC, AttachShader)                       \
    X(PFNGLBINDBUFFERPROC, BindBuffer)                           \
    X(PFNGLBINDFRAMEBUFFERPROC, BindFramebuffer)                 \
    X(PFNGLBINDRENDERBUFFERPROC, BindRenderbuffer)               \
    X(PFNGLBINDTEXTUREPROC, BindTexture)                         \
    X(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                 \
    X(PFNGLBLENDFUNCPROC, BlendFunc)                             \
    X(PFNGLBUFFERDATAPROC, BufferData)                           \
    X(PFNGLCHECKFRAMEBUFFERSTATUSPROC, CheckFramebufferStatus)   \
    X(PFNGLCLEARPROC, Clear)                                     \
    X(PFNGLCLEARCOLORPROC, ClearColor)                           \
    X(PFNGLCOMPILESHADERPROC, CompileShader)                     \
    X(PFNGLCREATEPROGRAMPROC, CreateProgram)                     \
    X(PFNGLCREATESHADERPROC, CreateShader)                       \
    X(PFNGLCULLFACEPROC, CullFace)                               \
    X(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                     \
    X(PFNGLDELETEFRAMEBUFFERSPROC, DeleteFramebuffers)           \
    X(PFNGLDELETEPROGRAMPROC, DeleteProgram)                     \
    X(PFNGLDELETERENDERBUFFERSPROC, DeleteRenderbuffers)         \
    X(PFNGLDELETESHADERPROC, DeleteShader)                       \
    X(PFNGLDELETETEXTURESPROC, DeleteTextures)                   \
    X(PFNGLDELETEVERTEXARRAYSPROC, DeleteVertexArrays)           \
    X(PFNGLDEPTHFUNCPROC, DepthFunc)                             \
    X(PFNGLDEPTHMASKPROC, DepthMask)                             \
    X(PFNGLDISABLEPROC, Disable)                                 \
    X(PFNGLDRAWARRAYSPROC, DrawArrays)                           \
    X(PFNGLDRAWELEMENTSPROC, DrawElements)                       \
    X(PFNGLENABLEPROC, Enable)                                   \
    X(PFNGLENABLEVERTEXATTRIBARRAYPROC, EnableVertexAttribArray) \
    X(PFNGLFRAMEBUFFERRENDERBUFFERPROC, FramebufferRenderbuffer) \
    X(PFNGLFRAMEBUFFERTEXTURE2DPROC, FramebufferTexture2D)       \
    X(PFNGLGENBUFFERSPROC, GenBuffers)                           \
    X(PFNGLGENFRAMEBUFFERSPROC, GenFramebuffers)                 \
    X(PFNGLGENRENDERBUFFERSPROC, GenRenderbuffers)               \
    X(PFNGLGENTEXTURESPROC, GenTextures)                         \
    X(PFNGLGENVERTEXARRAYSPROC, GenVertexArrays)                 \
    X(PFNGLGENERATEMIPMAPPROC, GenerateMipmap)                   \
    X(PFNGLGETINTEGERVPROC, GetIntegerv)                         \
    X(PFNGLGETPROGRAMIVPROC, GetProgramiv)                       \
    X(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)               \
    X(PFNGLGETSHADERIVPROC, GetShaderiv)                         \
    X(PFNGLGETSTRINGPROC, GetString)                             \
    X(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation)           \
    X(PFNGLLINEWIDTHPROC, LineWidth)                             \
    X(PFNGLLINKPROGRAMPROC, LinkProgram)                         \
    X(PFNGLPIXELSTOREIPROC, PixelStorei)                         \
    X(PFNGLRENDERBUFFERSTORAGEPROC, RenderbufferStorage)         \
    X(PFNGLSHADERSOURCEPROC, ShaderSource)                       \
    X(PFNGLTEXIMAGE2DPROC, TexImage2D)                           \
    X(PFNGLTEXPARAMETERIPROC, TexParameteri)                     \
    X(PFNGLTEXSUBIMAGE2DPROC, TexSubImage2D)                     \
    X(PFNGLUNIFORM1FPROC, Uniform1f)                             \
    X(PFNGLUNIFORM3FPROC, Uniform3f)                             \
    X(PFNGLUNIFORM4FPROC, Uniform4f)                             \
    X(PFNGLUNIFORMMATRIX4FVPROC, UniformMatrix4fv)               \
    X(PFNGLUSEPROGRAMPROC, UseProgram)                           \
    X(PFNGLVERTEXATTRIBPOINTERPROC, VertexAttribPointer)         \
    X(PFNGLVIEWPORTPROC, Viewport)

/// The functions of the context current at construction, without the prefix "gl".
struct Gl {
#define SELDINGER_GL_MEMBER(type, name) type name = nullptr;
    SELDINGER_GL_FUNCTIONS(SELDINGER_GL_MEMBER)
#undef SELDINGER_GL_MEMBER

    /// Throws io::InputError naming the first missing function.
    Gl();
};

}  // namespace app
