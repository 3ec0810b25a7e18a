#pragma once
/// Review of recorded runs: as a loop, frame by frame, with another mask, window and level, a ruler.

#include <memory>
#include <optional>
#include <vector>

#include "app/play/window.h"
#include "engine/room/sequence.h"

namespace app {

class Review {
public:
    explicit Review(const Gl& gl) : texture_(gl) {}

    /// Draws the review over the area [pixels] and takes the mouse and keys meant for it; `seconds` since it
    /// was last drawn. `wire`: diameter of the wire, by which the ruler can be calibrated [mm]. Returns false
    /// once the review is closed.
    bool draw(const std::vector<std::shared_ptr<const room::Sequence>>&, const render::Box&, const Window&,
              double seconds, double wire);
    /// Shows the image that was on the screen in this frame of the run.
    void go_to(const std::vector<std::shared_ptr<const room::Sequence>>&, int frame);
    bool moves() const { return plays_; }
    void reset();

private:
    void show();
    void draw_picture(const render::Box&, const Window&);

    Texture texture_;
    std::shared_ptr<const room::Sequence> run_;
    int number_ = 0;  // of the run chosen, 0 = the last
    room::Look look_;
    std::optional<room::Look> shown_;
    std::shared_ptr<const room::Sequence> shown_run_;
    render::GrayImage image_;
    long serial_ = 0;
    bool plays_ = true;
    double time_ = 0;                      // of the loop [s]
    float zoom_ = 1, left_ = 0, top_ = 0;  // of the part shown; offsets relative to the image's size
    bool rules_ = false, draws_ = false;
    std::optional<room::Ruler> ruler_;
    room::Scale scale_;
};

}  // namespace app
