#pragma once
/// The screen of the angiography room: live image, stored image and readouts.

#include <filesystem>
#include <memory>

#include "render/panel/readout.h"
#include "render/picture/image.h"

namespace render {

/// Folder of DejaVuSans.ttf and DejaVuSans-Bold.ttf: that of Debian's fonts-dejavu-core, or SELDINGER_FONTS.
std::filesystem::path font_folder();

struct PanelSpec {
    int width = 1280;                             // 640 to 4096 [pixels]
    int height = 1024;                            // 512 to 4096 [pixels]
    std::filesystem::path fonts = font_folder();  // without the faces ImGui's own is used
};

/// A rectangle of the panel [pixels].
struct PanelArea {
    int left = 0;
    int top = 0;
    int width = 0;
    int height = 0;
};

/// Draws one state after another; nothing is carried over from one to the next. To be used by one thread at a
/// time. A Fluoroscope used beside it keeps its own GL context.
class Panel {
public:
    /// Throws std::invalid_argument for a size outside its limits, std::runtime_error when GL fails.
    explicit Panel(PanelSpec = {});
    ~Panel();
    Panel& operator=(Panel&&) noexcept;

    /// `live` fills the left of the panel; apart from its few marks it is unaltered where its size is that of
    /// `live_area`, otherwise resampled. `reference` may be null. Throws std::invalid_argument for an image
    /// without pixels or with more than 4096 along a side.
    ColourImage draw(const GrayImage& live, const GrayImage* reference, const Readout&);

    /// The area for an image of that many pixels: the largest that keeps the image's shape. Side by side with
    /// the readouts, a panel of 1280 × 1024 has room for 1024 × 1024.
    PanelArea live_area(int image_width, int image_height) const;

    bool has_font() const;  // false when ImGui's own face is used

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace render
