#pragma once
/// An OpenGL context with no window.

namespace render {

/// Owns one OSMesa context (software rasteriser, core profile). All drawing goes through this class, so that
/// another source of contexts (EGL surfaceless) can replace it.
class OffscreenContext {
public:
    OffscreenContext();  // throws std::runtime_error when no context can be made
    ~OffscreenContext();
    OffscreenContext(const OffscreenContext&) = delete;
    OffscreenContext& operator=(const OffscreenContext&) = delete;

    /// To be called before each use: a window of the same process may have made its own context current.
    /// Throws std::runtime_error on failure.
    void make_current() const;

    /// The address of a GL function. Linked names are not safe: in a program that also links libGL they
    /// resolve to functions that do nothing here. Throws std::runtime_error for an unknown name.
    using Function = void (*)();
    Function function(const char* name) const;

private:
    struct State;
    State* state_;
};

}  // namespace render
