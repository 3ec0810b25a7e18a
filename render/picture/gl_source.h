#pragma once
/// Where OpenGL without a window comes from: OSMesa or EGL, chosen when the build is configured
/// (SELDINGER_GL). Both are Mesa's software rasteriser: of one version of Mesa they
/// draw the same pixels. For offscreen.cpp only.

namespace render::gl_source {

/// "OSMesa" or "EGL", and the package that brings it, for messages.
extern const char* const name;
extern const char* const package;

/// A context of the core profile of this version; null when there is none.
void* make_context(int major, int minor);
void destroy_context(void*);
/// Makes it the calling thread's; drawing goes to framebuffer objects. False on failure.
bool take(void* context);
/// The calling thread has no context afterwards.
void leave();

using Function = void (*)();
Function function(const char* name);  // null for an unknown one

}  // namespace render::gl_source
