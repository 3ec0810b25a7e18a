#include "app/play/window.h"

#include <algorithm>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <cmath>
#include <cstdint>
#include <imgui.h>
#include <map>

#include "engine/io/error.h"
#include "render/panel/panel.h"

namespace app {
namespace {

std::string last_error;  // of GLFW

void note_error(int, const char* text) {
    last_error = text;
}

/// GLFW's code of each key. Those of keys between the ones listed here follow one another, as the names do.
const std::vector<int>& codes() {
    static const std::vector<int> table = [] {
        const std::map<std::string_view, int> first = {{"Space", GLFW_KEY_SPACE},
                                                       {"Apostrophe", GLFW_KEY_APOSTROPHE},
                                                       {"Comma", GLFW_KEY_COMMA},
                                                       {"Semicolon", GLFW_KEY_SEMICOLON},
                                                       {"Equal", GLFW_KEY_EQUAL},
                                                       {"A", GLFW_KEY_A},
                                                       {"GraveAccent", GLFW_KEY_GRAVE_ACCENT},
                                                       {"Escape", GLFW_KEY_ESCAPE},
                                                       {"CapsLock", GLFW_KEY_CAPS_LOCK},
                                                       {"F1", GLFW_KEY_F1},
                                                       {"Keypad0", GLFW_KEY_KP_0},
                                                       {"LeftShift", GLFW_KEY_LEFT_SHIFT},
                                                       {"RightShift", GLFW_KEY_RIGHT_SHIFT}};
        std::vector<int> result;
        for (const std::string_view name : room::key_names()) {
            const auto listed = first.find(name);
            result.push_back(name.starts_with("Gamepad") ? GLFW_KEY_UNKNOWN
                             : listed != first.end()     ? listed->second
                                                         : result.back() + 1);
        }
        return result;
    }();
    return table;
}

constexpr std::pair<std::string_view, int> buttons[] = {
    {"GamepadA", GLFW_GAMEPAD_BUTTON_A},
    {"GamepadB", GLFW_GAMEPAD_BUTTON_B},
    {"GamepadX", GLFW_GAMEPAD_BUTTON_X},
    {"GamepadY", GLFW_GAMEPAD_BUTTON_Y},
    {"GamepadLeftBumper", GLFW_GAMEPAD_BUTTON_LEFT_BUMPER},
    {"GamepadRightBumper", GLFW_GAMEPAD_BUTTON_RIGHT_BUMPER},
    {"GamepadBack", GLFW_GAMEPAD_BUTTON_BACK},
    {"GamepadStart", GLFW_GAMEPAD_BUTTON_START},
    {"GamepadUp", GLFW_GAMEPAD_BUTTON_DPAD_UP},
    {"GamepadRight", GLFW_GAMEPAD_BUTTON_DPAD_RIGHT},
    {"GamepadDown", GLFW_GAMEPAD_BUTTON_DPAD_DOWN},
    {"GamepadLeft", GLFW_GAMEPAD_BUTTON_DPAD_LEFT},
    {"GamepadLeftStick", GLFW_GAMEPAD_BUTTON_LEFT_THUMB},
    {"GamepadRightStick", GLFW_GAMEPAD_BUTTON_RIGHT_THUMB}};

std::optional<GLFWgamepadstate> gamepad() {
    GLFWgamepadstate state;
    for (int stick = GLFW_JOYSTICK_1; stick <= GLFW_JOYSTICK_LAST; ++stick)
        if (glfwJoystickIsGamepad(stick) && glfwGetGamepadState(stick, &state)) return state;
    return std::nullopt;
}

}  // namespace

Texture::~Texture() {
    if (texture_) gl_.DeleteTextures(1, &texture_);
}

void Texture::show(const render::GrayImage& image, long serial, bool shrinks) {
    if ((serial == serial_ && shrinks == shrinks_) || image.pixels.empty()) return;
    serial_ = serial;
    shrinks_ = shrinks;
    if (!texture_) gl_.GenTextures(1, &texture_);
    gl_.BindTexture(GL_TEXTURE_2D, texture_);
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    if (width_ != image.width || height_ != image.height) {
        width_ = image.width;
        height_ = image.height;
        gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_R8, width_, height_, 0, GL_RED, GL_UNSIGNED_BYTE,
                       image.pixels.data());
        gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_G, GL_RED);
        gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_B, GL_RED);
        gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    } else {
        gl_.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_RED, GL_UNSIGNED_BYTE,
                          image.pixels.data());
    }
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, shrinks ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR);
    if (shrinks) gl_.GenerateMipmap(GL_TEXTURE_2D);
}

/// Events come for any window, whichever is activated: Dear ImGui is told of each in the context of its
/// window.
struct Window::Callbacks {
    class Of {
    public:
        explicit Of(GLFWwindow* window)
            : self_(static_cast<Window*>(glfwGetWindowUserPointer(window))),
              before_(ImGui::GetCurrentContext()) {
            ImGui::SetCurrentContext(self_->imgui_);
            self_->events_.any = true;
        }
        ~Of() { ImGui::SetCurrentContext(before_); }
        Of(const Of&) = delete;
        Of& operator=(const Of&) = delete;
        Window* operator->() const { return self_; }

    private:
        Window* self_;
        ImGuiContext* before_;
    };

    static void key(GLFWwindow* window, int code, int scan, int action, int mods) {
        const Of self(window);
        ImGui_ImplGlfw_KeyCallback(window, code, scan, action, mods);
        if (code == GLFW_KEY_UNKNOWN) return;
        const auto& table = codes();
        const auto found = std::find(table.begin(), table.end(), code);
        if (found == table.end()) return;
        self->change(static_cast<room::Key>(found - table.begin()), action != GLFW_RELEASE,
                     action == GLFW_PRESS);
    }
    static void character(GLFWwindow* window, unsigned code) {
        const Of self(window);
        ImGui_ImplGlfw_CharCallback(window, code);
    }
    static void focus(GLFWwindow* window, int has) {
        const Of self(window);
        ImGui_ImplGlfw_WindowFocusCallback(window, has);
        // A window that loses the focus is never told that a key was released.
        if (!has) std::fill(self->held_.begin(), self->held_.end(), false);
    }
    static void scroll(GLFWwindow* window, double x, double y) {
        const Of self(window);
        ImGui_ImplGlfw_ScrollCallback(window, x, y);
        self->events_.wheel += y;
    }
    static void size(GLFWwindow* window, int width, int height) {
        const Of self(window);
        self->width_ = width;
        self->height_ = height;
    }
    static void touched(GLFWwindow* window) { const Of self(window); }
    static void cursor(GLFWwindow* window, double, double) { touched(window); }
    static void enter(GLFWwindow* window, int entered) {
        const Of self(window);
        ImGui_ImplGlfw_CursorEnterCallback(window, entered);
    }
    static void button(GLFWwindow* window, int number, int action, int mods) {
        const Of self(window);
        ImGui_ImplGlfw_MouseButtonCallback(window, number, action, mods);
    }
};

namespace {

int open_windows = 0;

/// Throws io::InputError with the version of OpenGL that there is.
[[noreturn]] void refuse_display() {
    const std::string why = last_error;
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    std::string found = "none";
    if (GLFWwindow* any = glfwCreateWindow(16, 16, "", nullptr, nullptr)) {
        glfwMakeContextCurrent(any);
        if (const auto get = reinterpret_cast<PFNGLGETSTRINGPROC>(glfwGetProcAddress("glGetString")))
            found = reinterpret_cast<const char*>(get(GL_VERSION));
        glfwDestroyWindow(any);
    }
    if (open_windows == 0) glfwTerminate();
    throw io::InputError(
        "the window needs OpenGL 3.3; found was {} ({}); without a window, 'seldinger run' plays scripts "
        "and recordings",
        found, why);
}

}  // namespace

Window::Window(const Place& place, const std::string& title) : held_(room::key_names().size(), false) {
    glfwSetErrorCallback(note_error);
    if (!glfwInit())
        throw io::InputError(
            "no display to open a window on ({}); without one, 'seldinger run' plays scripts and recordings",
            last_error);
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    if (place.beside) {
        glfwWindowHint(GLFW_FOCUSED, GLFW_FALSE);
        glfwWindowHint(GLFW_FOCUS_ON_SHOW, GLFW_FALSE);
        glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    }
    window_ = glfwCreateWindow(place.width, place.height, title.c_str(), nullptr, nullptr);
    if (!window_) refuse_display();
    ++open_windows;
    if (place.beside) {
        put_beside(*place.beside);
        glfwShowWindow(window_);
    }
    glfwMakeContextCurrent(window_);
    // Windows that all waited for their screens would wait for one another.
    glfwSwapInterval(place.beside ? 0 : 1);
    gl_ = std::make_unique<Gl>();
    glfwGetFramebufferSize(window_, &width_, &height_);
    glfwSetWindowSizeLimits(window_, 320, 240, GLFW_DONT_CARE, GLFW_DONT_CARE);

    imgui_ = ImGui::CreateContext();
    ImGui::SetCurrentContext(imgui_);
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.LogFilename = nullptr;
    io.ConfigWindowsMoveFromTitleBarOnly = true;
    ImGui_ImplGlfw_InitForOpenGL(window_, false);
    ImGui_ImplOpenGL3_Init("#version 330");

    glfwSetWindowUserPointer(window_, this);
    glfwSetKeyCallback(window_, Callbacks::key);
    glfwSetCharCallback(window_, Callbacks::character);
    glfwSetWindowFocusCallback(window_, Callbacks::focus);
    glfwSetScrollCallback(window_, Callbacks::scroll);
    glfwSetCursorPosCallback(window_, Callbacks::cursor);
    glfwSetCursorEnterCallback(window_, Callbacks::enter);
    glfwSetMouseButtonCallback(window_, Callbacks::button);
    glfwSetFramebufferSizeCallback(window_, Callbacks::size);
    glfwSetWindowRefreshCallback(window_, Callbacks::touched);
    events_.any = true;
}

Window::~Window() {
    activate();
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext(imgui_);
    glfwDestroyWindow(window_);
    if (--open_windows == 0) glfwTerminate();
}

/// In the middle of a monitor that does not show the other window; else to its right or left, as far as
/// there is room.
void Window::put_beside(const Window& other) const {
    int x = 0, y = 0, width = 0, height = 0, mine_wide = 0, mine_high = 0, count = 0;
    glfwGetWindowPos(other.window_, &x, &y);
    glfwGetWindowSize(other.window_, &width, &height);
    glfwGetWindowSize(window_, &mine_wide, &mine_high);
    GLFWmonitor** monitors = glfwGetMonitors(&count);
    for (int k = 0; k < count; ++k) {
        int left = 0, top = 0, wide = 0, high = 0;
        glfwGetMonitorWorkarea(monitors[k], &left, &top, &wide, &high);
        const bool shows_other = x + width / 2 >= left && x + width / 2 < left + wide &&
                                 y + height / 2 >= top && y + height / 2 < top + high;
        if (!shows_other)
            return glfwSetWindowPos(window_, left + std::max(0, (wide - mine_wide) / 2),
                                    top + std::max(0, (high - mine_high) / 2));
        const int on_right = left + wide - (x + width), on_left = x - left;
        const int beside = on_right >= on_left ? std::min(x + width, left + std::max(0, wide - mine_wide))
                                               : std::max(left, x - mine_wide);
        glfwSetWindowPos(window_, beside, std::clamp(y, top, top + std::max(0, high - mine_high)));
    }
}

void Window::activate() const {
    glfwMakeContextCurrent(window_);
    ImGui::SetCurrentContext(imgui_);
}

void Window::change(room::Key key, bool down, bool pressed) {
    held_[static_cast<std::size_t>(key)] = down;
    if (!pressed) return;
    events_.pressed.push_back(key);
    if (!events_.first_press) events_.first_press = room::Clock::now();
}

void Window::wait(double seconds) {
    if (seconds > 0)
        glfwWaitEventsTimeout(seconds);
    else
        glfwPollEvents();
    poll_gamepad();
}

void Window::wake() {
    glfwPostEmptyEvent();
}

void Window::poll_gamepad() {
    const std::optional<GLFWgamepadstate> state = gamepad();
    for (const auto& [name, button] : buttons) {
        const room::Key key = *room::find_key(name);
        const bool down = state && state->buttons[button] == GLFW_PRESS;
        const bool was = holds(key);
        if (down == was) continue;
        events_.any = true;
        change(key, down, down);
    }
}

Window::Sticks Window::sticks() const {
    const std::optional<GLFWgamepadstate> state = gamepad();
    if (!state) return {};
    const auto axis = [&](int k) {
        const double value = state->axes[k];
        return std::isfinite(value) ? std::clamp(value, -1.0, 1.0) : 0.0;
    };
    static_assert(room::sides[0] == room::Side::Right);
    return {{-axis(GLFW_GAMEPAD_AXIS_RIGHT_Y), -axis(GLFW_GAMEPAD_AXIS_LEFT_Y)},
            {axis(GLFW_GAMEPAD_AXIS_RIGHT_X), axis(GLFW_GAMEPAD_AXIS_LEFT_X)}};
}

std::vector<std::string> Window::key_labels() {
    std::vector<std::string> labels;
    for (std::size_t k = 0; k < codes().size(); ++k) {
        const char* sign = codes()[k] == GLFW_KEY_UNKNOWN ? nullptr : glfwGetKeyName(codes()[k], 0);
        labels.push_back(room::label_of(room::key_names()[k], sign ? sign : ""));
    }
    return labels;
}

Events Window::take_events() {
    return std::exchange(events_, Events());
}

bool Window::wants_to_close() const {
    return glfwWindowShouldClose(window_) != 0;
}
void Window::set_title(const std::string& title) {
    glfwSetWindowTitle(window_, title.c_str());
}
bool Window::can_be_seen() const {
    return width_ > 0 && height_ > 0 && !glfwGetWindowAttrib(window_, GLFW_ICONIFIED);
}

void Window::make_faces(float unit) {
    ImGuiIO& io = ImGui::GetIO();
#if IMGUI_VERSION_NUM < 19200  // later ones keep the texture up to date by themselves
    ImGui_ImplOpenGL3_DestroyFontsTexture();
#endif
    io.Fonts->Clear();
    faces_ = render::add_faces(*io.Fonts, unit, render::font_folder());
    io.FontDefault = faces_.fonts[static_cast<std::size_t>(render::Face::Plain)];
#if IMGUI_VERSION_NUM < 19200
    ImGui_ImplOpenGL3_CreateFontsTexture();
#endif
    ImGuiStyle style;
    ImGui::StyleColorsDark(&style);
    style.WindowRounding = 5;
    style.ChildRounding = 5;
    style.FrameRounding = 3;
    style.WindowPadding = ImVec2(16, 14);
    style.FramePadding = ImVec2(10, 5);
    style.ItemSpacing = ImVec2(8, 6);
    style.ScaleAllSizes(unit);
    ImGui::GetStyle() = style;
    unit_ = unit;
}

float Window::fitting_unit() const {
    const float fits = std::min((static_cast<float>(height_) - 30) / 790, static_cast<float>(width_) / 1050);
    constexpr float steps = 20;
    return std::clamp(std::floor(fits * steps) / steps, 0.6f, 4.0f);
}

void Window::begin_frame(float unit) {
    activate();
    if (unit != unit_) make_faces(unit);
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
#if IMGUI_VERSION_NUM < 18700
    // Enter acts as Space does, on what the keys have reached, as by itself in later versions.
    ImGuiIO& io = ImGui::GetIO();
    if (!io.WantTextInput &&
        (ImGui::IsKeyDown(io.KeyMap[ImGuiKey_Enter]) || ImGui::IsKeyDown(io.KeyMap[ImGuiKey_KeyPadEnter])))
        io.NavInputs[ImGuiNavInput_Activate] = 1;
#endif
    ImGui::NewFrame();
}

void Window::end_frame() {
    ImGui::Render();
    gl_->BindFramebuffer(GL_FRAMEBUFFER, 0);
    gl_->Viewport(0, 0, width_, height_);
    gl_->ClearColor(14 / 255.f, 18 / 255.f, 21 / 255.f, 1);
    gl_->Clear(GL_COLOR_BUFFER_BIT);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    glfwSwapBuffers(window_);
}

}  // namespace app
