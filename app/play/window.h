#pragma once
/// The window: GLFW, OpenGL 3.3 and Dear ImGui, the hands' input, and pictures on its GPU.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/play/gl.h"
#include "engine/room/hands.h"
#include "engine/room/session.h"
#include "render/panel/canvas.h"
#include "render/picture/image.h"

struct ImGuiContext;

namespace app {

/// A grey image in a texture of the window's OpenGL.
class Texture {
public:
    explicit Texture(const Gl& gl) : gl_(gl) {}
    ~Texture();
    Texture(const Texture&) = delete;
    Texture& operator=(const Texture&) = delete;

    /// `serial` of the image: an image already in the texture is not sent again. `shrinks`: the image is
    /// shown smaller than it is, and needs means of its pixels.
    void show(const render::GrayImage&, long serial, bool shrinks = true);
    bool empty() const { return width_ == 0; }
    int width() const { return width_; }
    int height() const { return height_; }
    GLuint id() const { return texture_; }

private:
    const Gl& gl_;
    GLuint texture_ = 0;
    int width_ = 0, height_ = 0;
    long serial_ = -1;
    bool shrinks_ = false;
};

/// Events since the last call.
struct Events {
    std::vector<room::Key> pressed;
    std::optional<room::Clock::time_point> first_press;
    double wheel = 0;
    bool any = false;  // the window must be redrawn
};

/// A window with an OpenGL and a Dear ImGui of its own. There may be several, all of one thread and one
/// display: what belongs to a window acts on the one that is activated.
class Window {
public:
    /// Where it opens. Beside another it takes no focus from it: on a monitor of its own where there is one,
    /// else where the other leaves most room.
    struct Place {
        int width = 1280, height = 800;
        const Window* beside = nullptr;
    };
    /// Throws io::InputError where there is no display or its OpenGL is too old, stating the version found.
    Window(const Place&, const std::string& title);
    Window(int width, int height, const std::string& title) : Window(Place{width, height}, title) {}
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    /// Waits for an event or for wake(), at most this long [s].
    void wait(double seconds);
    static void wake();  // from any thread
    Events take_events();
    bool holds(room::Key key) const { return held_[static_cast<std::size_t>(key)]; }
    /// Sticks of a gamepad, -1 to 1.
    struct Sticks {
        std::array<double, 2> push{}, turn{};  // of each room::Side
    };
    Sticks sticks() const;
    /// What is shown for each key in the layout that the keyboard has now.
    static std::vector<std::string> key_labels();
    bool wants_to_close() const;
    void set_title(const std::string&);
    bool can_be_seen() const;  // neither minimised nor without area

    /// Textures and ImGui are this window's from now on; as after construction, and in its frames.
    void activate() const;
    /// ImGui may be used between these two. The faces are sized by `unit` [pixels].
    void begin_frame(float unit);
    void end_frame();

    const Gl& gl() const { return *gl_; }
    int width() const { return width_; }    // of the framebuffer [pixels]
    int height() const { return height_; }  // [pixels]
    const render::CanvasFaces& faces() const { return faces_; }
    float unit() const { return unit_; }
    /// The largest unit at which the readouts fit the height, in steps, as each needs its own fonts.
    float fitting_unit() const;

private:
    struct Callbacks;
    void put_beside(const Window&) const;
    void change(room::Key, bool down, bool pressed);
    void poll_gamepad();
    void make_faces(float unit);

    GLFWwindow* window_ = nullptr;
    ImGuiContext* imgui_ = nullptr;
    std::unique_ptr<Gl> gl_;
    int width_ = 0, height_ = 0;
    float unit_ = 0;
    render::CanvasFaces faces_;
    std::vector<bool> held_;
    Events events_;
};

}  // namespace app
