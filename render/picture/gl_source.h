#pragma once
/// Where OpenGL without a window comes from: OSMesa or EGL, chosen when the build is configured
/// (SELDINGER_GL). Both are Mesa's software rasteriser: of one version of Mesa they
/// draw the same pixels. For offscreen.cpp only.

namespace render::gl_source {

/// "OSMesa" or "EGL", and the package that brings it, for messages.
extern const char* const name;
extern const char* const package;

/// The first lines of a shader: its language's version, and precisions where the language has them.
extern const char* const shader_header;

/// Whether there are contexts that add floats to a target of floats, as path lengths need: everywhere but in
/// some browsers.
bool adds_floats();

/// A context of the core profile of this version; null when there is none.
void* make_context(int major, int minor);
void destroy_context(void*);
/// Makes it the calling thread's; drawing goes to framebuffer objects. False on failure.
bool take(void* context);
/// The calling thread has no context afterwards.
void leave();

/// What the source needs of the process, before the first context and before each use: throws
/// std::runtime_error where the rasteriser would end or stop the program.
enum class Moment { First, Use };
void require_usable(Moment);
/// To be called when a context was made.
void made();
/// Whether contexts may still be destroyed: not in a process that was forked after they were made.
bool is_of_this_process();

using Function = void (*)();
Function function(const char* name);  // null for an unknown one

}  // namespace render::gl_source
