#include "engine/room/sequence.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "render/xray/subtraction.h"

namespace room {
namespace {

/// Interpolates between four pixels; beyond the edge the edge repeats.
template <class Image>
double between(const Image& values, int width, int height, double x, double y) {
    x = std::clamp(x, 0.0, width - 1.0);
    y = std::clamp(y, 0.0, height - 1.0);
    const int i = std::min(static_cast<int>(x), std::max(0, width - 2));
    const int j = std::min(static_cast<int>(y), std::max(0, height - 2));
    const int right = std::min(i + 1, width - 1), below = std::min(j + 1, height - 1);
    const double u = x - i, v = y - j;
    const auto at = [&](int column, int row) {
        return static_cast<double>(values[static_cast<std::size_t>(row) * width + column]);
    };
    return (1 - v) * ((1 - u) * at(i, j) + u * at(right, j)) +
           v * ((1 - u) * at(i, below) + u * at(right, below));
}

}  // namespace

void Sequences::observe(const exercise::Frame& frame, exercise::Monitor& monitor,
                        const std::shared_ptr<const render::GrayImage>& shown) {
    if (frame.motion.reset) {
        runs_.clear();
        taken_ = 0;
        beam_on_ = false;
    }
    const exercise::Console& console = frame.simulation.console();
    if (!console.beam_on()) {
        beam_on_ = false;
        return;
    }
    const exercise::Pulse* pulse = monitor.last_pulse();
    if (!frame.motion.console.pulse || !pulse) return;
    const bool dsa = pulse->mode == script::ImagingMode::Dsa;
    const bool goes_on = beam_on_ && !runs_.empty() && runs_.back()->mode == pulse->mode &&
                         runs_.back()->arm == pulse->arm && !pulse->new_mask;
    beam_on_ = true;
    Sequence run;
    if (goes_on) {
        run = *runs_.back();
    } else {
        run.number = ++taken_;
        run.mode = pulse->mode;
        run.arm = pulse->arm;
        run.pulse_rate = console.pulse_rate();
        if (dsa) {
            render::Fluoroscope& fluoroscope = monitor.fluoroscope();
            run.opening = std::make_shared<render::Field>(fluoroscope.opening(pulse->arm));
            run.scatter = std::make_shared<render::Field>(
                fluoroscope.scatter_in(monitor.last_signal(), pulse->arm, pulse->exposure));
        }
        runs_.push_back(nullptr);
    }
    run.images.push_back({pulse->time, shown, {}});
    if (dsa) run.images.back().signal = std::make_shared<render::Field>(monitor.last_signal());
    if (!script::acquires(run.mode) && run.images.size() > most_images_) run.images.erase(run.images.begin());
    runs_.back() = std::make_shared<const Sequence>(std::move(run));
    limit();
}

void Sequences::limit() {
    // Only the last run of fluoroscopy is kept; of acquisitions as many as there is room for.
    const auto weight = [](const Sequence& run) {
        return run.mode == script::ImagingMode::Dsa ? images_of_dsa : std::size_t{script::acquires(run.mode)};
    };
    std::size_t kept = 0;
    for (auto run = runs_.begin(); run != runs_.end();) {
        const bool last = std::next(run) == runs_.end();
        kept += weight(**run) * (*run)->images.size();
        run = !last && !script::acquires((*run)->mode) ? runs_.erase(run) : std::next(run);
    }
    while (kept > most_acquired_) {
        Sequence oldest = *runs_.front();
        if (runs_.size() > 1) {
            kept -= weight(oldest) * oldest.images.size();
            runs_.pop_front();
        } else {
            oldest.images.erase(oldest.images.begin() + 1);  // the first may be the mask
            kept -= weight(oldest);
            runs_.front() = std::make_shared<const Sequence>(std::move(oldest));
        }
    }
}

render::GrayImage look_at(const Sequence& run, const Look& look) {
    const KeptImage& kept = run.images.at(look.image);
    render::GrayImage image;
    if (run.mode == script::ImagingMode::Dsa) {
        const KeptImage& mask = run.images.at(look.mask);
        render::Subtraction subtraction(*mask.signal, *run.opening, *run.scatter);
        subtraction.shift_mask({look.shift_x, look.shift_y}, false);
        image = subtraction.subtracted(*kept.signal);
    } else {
        image = *kept.shown;
    }
    if (look.window == 256 && look.level == 128) return image;
    std::uint8_t grey[256];
    for (int k = 0; k < 256; ++k) {
        const double value = 128 + (k - look.level) * 256 / std::max(1.0, look.window);
        grey[k] = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0l, 255l));
    }
    for (std::uint8_t& pixel : image.pixels) pixel = grey[pixel];
    return image;
}

Moment moment_of(const std::vector<std::shared_ptr<const Sequence>>& runs, int frame) {
    Moment at;
    for (const auto& run : runs)
        for (std::size_t k = 0; k < run->images.size(); ++k)
            if (!at.run || run->images[k].time.index <= frame) at = {run, k};
    return at;
}

double Ruler::pixels() const {
    return std::hypot(x1 - x0, y1 - y0);
}

std::optional<double> band_width(const render::GrayImage& image, const Ruler& ruler) {
    const double length = ruler.pixels();
    if (!(length >= 3) || image.pixels.empty()) return std::nullopt;
    constexpr int per_pixel = 8;
    const int count = static_cast<int>(std::min(length, 4000.0) * per_pixel) + 1;
    std::vector<double> profile(count);
    for (int k = 0; k < count; ++k) {
        const double t = k / (count - 1.0);
        profile[k] =
            between(image.pixels, image.width, image.height, ruler.x0 + t * (ruler.x1 - ruler.x0) - 0.5,
                    ruler.y0 + t * (ruler.y1 - ruler.y0) - 0.5);
    }
    const int darkest = static_cast<int>(std::ranges::min_element(profile) - profile.begin());
    const double background = std::min(*std::max_element(profile.begin(), profile.begin() + darkest + 1),
                                       *std::max_element(profile.begin() + darkest, profile.end()));
    const double depth = background - profile[darkest];
    if (depth < 4) return std::nullopt;  // within the noise
    const double half = background - depth / 2;
    int left = darkest, right = darkest;
    while (left > 0 && profile[left] < half) --left;
    while (right + 1 < count && profile[right] < half) ++right;
    if (profile[left] < half || profile[right] < half) return std::nullopt;
    return (right - left - 1) * length / (count - 1);
}

void Scale::calibrate(const render::GrayImage& image, const Ruler& ruler, double diameter) {
    const auto width = band_width(image, ruler);
    if (width) calibrated = diameter / *width;
    found =
        width ? fmt::format("{:.3f} mm are {:.2f} pixels", diameter, *width) : "no dark band under the ruler";
}

double Scale::mm_per_pixel(const Sequence& run) const {
    return calibrated.value_or(render::pixel_width(run.arm) * run.arm.sod / run.arm.sid);
}

std::string Scale::length(const Sequence& run, const Ruler& ruler) const {
    return fmt::format("{:.2f} mm  ({:.1f} pixels)", ruler.pixels() * mm_per_pixel(run), ruler.pixels());
}

std::string Scale::text(const Sequence& run) const {
    return fmt::format("{}: {:.4f} mm a pixel", calibrated ? "calibrated on the wire" : "at the isocentre",
                       mm_per_pixel(run));
}

}  // namespace room
