#pragma once
/// A virtual display without a viewer, and hands for the windows on it: Xvfb, driven through the X server's
/// own test extension, so that a program meets real events.

#include <functional>
#include <memory>
#include <string>

#include "render/picture/image.h"

namespace test {

class VirtualDisplay {
public:
    /// Starts Xvfb. Throws std::runtime_error where there is none, or it does not answer.
    VirtualDisplay(int width, int height);
    ~VirtualDisplay();
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;

    const std::string& name() const { return name_; }  // ":7", for DISPLAY

    /// Finds a window whose title holds the words; false where there is none.
    bool find(const std::string& words);
    /// Title of the topmost window that has one; empty when there is none.
    std::string title();
    /// Keys by the X server's names: "Up", "space", "F12", "Shift_L". Throws std::invalid_argument for
    /// others.
    void key(const std::string& name, bool down);
    /// Returns at once; whatever is asked of the display next waits for the key to be up. `held`: for how
    /// long the key is down, by the X server's clock [s].
    void tap(const std::string& name, double held = 0.05);
    void move_mouse(int x, int y);
    void click(int x, int y);  // with the left button
    /// To one of the keyboard's layouts, counted from 0.
    void switch_layout(unsigned number);
    /// Resizes the window found last.
    void resize(int width, int height);
    void iconify();
    void take_focus();  // from every window
    void give_focus();
    void close();  // as its button would
    /// A picture of the whole display.
    render::ColourImage screenshot();

private:
    struct X;
    std::unique_ptr<X> x_;
    std::string name_;
};

void sleep_for(double seconds);
/// Asks until the answer is yes; false after this many seconds.
bool wait_until(const std::function<bool()>& answer, double seconds);

}  // namespace test
