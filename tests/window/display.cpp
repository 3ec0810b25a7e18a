#include "tests/window/display.h"

#include <X11/XKBlib.h>
#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <array>
#include <chrono>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace test {

void sleep_for(double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

bool wait_until(const std::function<bool()>& answer, double seconds) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (!answer()) {
        if (std::chrono::steady_clock::now() >= end) return false;
        sleep_for(0.02);
    }
    return true;
}

struct VirtualDisplay::X {
    pid_t server = -1;
    ::Display* display = nullptr;
    ::Window found = 0;

    ~X() {
        if (display) XCloseDisplay(display);
        if (server > 0) {
            ::kill(server, SIGTERM);
            int status = 0;
            ::waitpid(server, &status, 0);
        }
    }

    std::string title_of(::Window window) const {
        char* text = nullptr;
        std::string title;
        if (XFetchName(display, window, &text) && text) title = text;
        if (text) XFree(text);
        return title;
    }

    /// Windows that go away while they are asked cause errors that do not matter.
    static int ignore(::Display*, XErrorEvent*) { return 0; }

    /// `later`: how long the server waits before [s].
    void send(const std::string& key_name, bool down, double later) const {
        const KeySym symbol = XStringToKeysym(key_name.c_str());
        const KeyCode code = symbol == NoSymbol ? 0 : XKeysymToKeycode(display, symbol);
        if (code == 0) throw std::invalid_argument("no key " + key_name);
        XTestFakeKeyEvent(display, code, down, static_cast<unsigned long>(1000 * later));
        XFlush(display);
    }

    ::Window find(const std::string& words) const {
        ::Window root = DefaultRootWindow(display), parent = 0, *children = nullptr;
        unsigned count = 0;
        ::Window match = 0;
        if (!XQueryTree(display, root, &root, &parent, &children, &count)) return 0;
        for (unsigned k = 0; k < count; ++k) {
            const std::string title = title_of(children[k]);
            if (!title.empty() && title.find(words) != std::string::npos) match = children[k];
        }
        if (children) XFree(children);
        return match;
    }
};

VirtualDisplay::VirtualDisplay(int width, int height) : x_(std::make_unique<X>()) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe to Xvfb");
    const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
    const std::string descriptor = std::to_string(ends[1]);
    x_->server = ::fork();
    if (x_->server == 0) {
        ::close(ends[0]);
        ::freopen("/dev/null", "w", stderr);
        ::execlp("Xvfb", "Xvfb", "-displayfd", descriptor.c_str(), "-screen", "0", screen.c_str(),
                 "-nolisten", "tcp", static_cast<char*>(nullptr));
        ::_exit(127);
    }
    ::close(ends[1]);
    std::string number;
    for (char c; ::read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
    ::close(ends[0]);
    if (number.empty()) throw std::runtime_error("Xvfb did not start: is it installed?");
    name_ = ":" + number;
    x_->display = XOpenDisplay(name_.c_str());
    if (!x_->display) throw std::runtime_error("Xvfb does not answer on " + name_);
    XSetErrorHandler(X::ignore);
}

VirtualDisplay::~VirtualDisplay() = default;

bool VirtualDisplay::find(const std::string& words) {
    const ::Window window = x_->find(words);
    if (window) x_->found = window;
    return window != 0;
}

std::string VirtualDisplay::title() {
    const ::Window window = x_->find("");
    return window ? x_->title_of(window) : std::string();
}

void VirtualDisplay::key(const std::string& key_name, bool down) {
    x_->send(key_name, down, 0);
}

void VirtualDisplay::tap(const std::string& key_name, double held) {
    x_->send(key_name, true, 0);
    x_->send(key_name, false, held);
}

void VirtualDisplay::move_mouse(int x, int y) {
    XTestFakeMotionEvent(x_->display, -1, x, y, 0);
    XFlush(x_->display);
}

void VirtualDisplay::click(int x, int y) {
    move_mouse(x, y);
    sleep_for(0.3);  // what lies there is told of the mouse first
    XTestFakeButtonEvent(x_->display, 1, True, 0);
    XTestFakeButtonEvent(x_->display, 1, False, 150);
    XFlush(x_->display);
}

void VirtualDisplay::switch_layout(unsigned number) {
    XkbLockGroup(x_->display, XkbUseCoreKbd, number);
    XFlush(x_->display);
}

void VirtualDisplay::resize(int width, int height) {
    XResizeWindow(x_->display, x_->found, static_cast<unsigned>(width), static_cast<unsigned>(height));
    XFlush(x_->display);
}
void VirtualDisplay::iconify() {
    XUnmapWindow(x_->display, x_->found);
    XFlush(x_->display);
    sleep_for(0.3);
    XMapWindow(x_->display, x_->found);
    XFlush(x_->display);
}
void VirtualDisplay::take_focus() {
    XSetInputFocus(x_->display, None, RevertToNone, CurrentTime);
    XFlush(x_->display);
}
void VirtualDisplay::give_focus() {
    XSetInputFocus(x_->display, x_->found, RevertToPointerRoot, CurrentTime);
    XFlush(x_->display);
}

void VirtualDisplay::close() {
    XEvent event;
    std::memset(&event, 0, sizeof event);
    event.xclient.type = ClientMessage;
    event.xclient.window = x_->found;
    event.xclient.message_type = XInternAtom(x_->display, "WM_PROTOCOLS", False);
    event.xclient.format = 32;
    event.xclient.data.l[0] = static_cast<long>(XInternAtom(x_->display, "WM_DELETE_WINDOW", False));
    XSendEvent(x_->display, x_->found, False, NoEventMask, &event);
    XFlush(x_->display);
}

render::ColourImage VirtualDisplay::screenshot() {
    const int screen = DefaultScreen(x_->display);
    const int width = DisplayWidth(x_->display, screen), height = DisplayHeight(x_->display, screen);
    XImage* taken = XGetImage(x_->display, DefaultRootWindow(x_->display), 0, 0, static_cast<unsigned>(width),
                              static_cast<unsigned>(height), AllPlanes, ZPixmap);
    if (!taken) throw std::runtime_error("no picture of the display");
    render::ColourImage image{width, height, {}};
    image.pixels.reserve(3 * static_cast<std::size_t>(width) * height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const unsigned long pixel = XGetPixel(taken, x, y);
            for (const int shift : {16, 8, 0})
                image.pixels.push_back(static_cast<std::uint8_t>(pixel >> shift & 0xFF));
        }
    XDestroyImage(taken);
    return image;
}

}  // namespace test
