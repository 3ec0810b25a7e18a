#pragma once
/// An OpenGL context with no window.

namespace render {

/// Owns one context (software rasteriser, core profile) of OSMesa or, without a surface, of EGL
/// (gl_source.h). All drawing goes through this class.
class OffscreenContext {
    struct State;

public:
    /// Throws std::runtime_error when no context can be made, and in a process that was forked from one that
    /// had made some: the rasteriser's threads are not there.
    OffscreenContext();
    ~OffscreenContext();
    OffscreenContext(const OffscreenContext&) = delete;
    OffscreenContext& operator=(const OffscreenContext&) = delete;

    /// The context of the calling thread while it lives, and of no thread afterwards: the next use may be in
    /// another thread, and Mesa touches a thread's last context when that thread takes another one.
    class Use {
    public:
        ~Use();
        Use(const Use&) = delete;
        Use& operator=(const Use&) = delete;

    private:
        friend class OffscreenContext;
        explicit Use(const State&);
    };
    /// To be held while GL is called, by one thread at a time; a thread holds one. Throws std::runtime_error
    /// on failure.
    [[nodiscard]] Use use() const;

    /// The address of a GL function. Linked names are not safe: in a program that also links libGL they
    /// resolve to functions that do nothing here. Throws std::runtime_error for an unknown name.
    using Function = void (*)();
    Function function(const char* name) const;

private:
    State* state_;
};

}  // namespace render
