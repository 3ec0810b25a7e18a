#pragma once
/// The functions of OpenGL that are used for drawing here, without "gl": RENDER_GL_FUNCTIONS(X) is X(name) of
/// each.

// clang-format off
#define RENDER_GL_FUNCTIONS(X) \
    X(AttachShader) X(BindBuffer) X(BindFramebuffer) X(BindTexture) X(BindVertexArray) X(BlendEquation) \
    X(BlendFunc) X(BufferData) X(CheckFramebufferStatus) X(Clear) X(ClearColor) X(CompileShader) \
    X(CreateProgram) X(CreateShader) X(DeleteBuffers) X(DeleteFramebuffers) X(DeleteProgram) \
    X(DeleteShader) X(DeleteTextures) X(DeleteVertexArrays) X(Disable) X(DrawElements) \
    X(DrawElementsBaseVertex) X(Enable) X(EnableVertexAttribArray) X(FramebufferTexture2D) X(GenBuffers) \
    X(GenFramebuffers) X(GenTextures) X(GenVertexArrays) X(GetError) X(GetProgramiv) X(GetUniformLocation) \
    X(LinkProgram) X(PixelStorei) X(ReadPixels) X(Scissor) X(ShaderSource) X(TexImage2D) X(TexParameteri) \
    X(TexParameteriv) X(TexSubImage2D) X(Uniform1f) X(Uniform2f) X(Uniform3f) X(UniformMatrix4fv) \
    X(UseProgram) X(VertexAttribPointer) X(Viewport)
// clang-format on
