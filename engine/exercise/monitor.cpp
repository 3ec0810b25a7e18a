#include "engine/exercise/monitor.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "physics/geometry/maths.h"

namespace exercise {
namespace {

/// Fraction of earlier images in a live image, where nothing moves: detectors retain a few per cent,
/// fluoroscopy's recursive noise filter the rest. A roadmap's is stronger: the logarithm behind bone raises
/// noise. Cine has little more than the detector's.
constexpr float usual_lag = 0.4f, roadmap_lag = 0.5f, cine_lag = 0.05f;

float lag_of(script::ImagingMode mode) {
    return mode == script::ImagingMode::Roadmap ? roadmap_lag
           : mode == script::ImagingMode::Cine  ? cine_lag
                                                : usual_lag;
}

/// Up to this fraction of the image is searched for the mask: at 300 mm of field more than a deep breath
/// moves.
constexpr double searched_fraction = 0.125;
constexpr double least_found = 0.05;   // shift that is made [pixels]
constexpr std::size_t remembered = 4;  // pulses; the oldest counts for those before it, too

/// From the last pulse at another place until the image is sharp [s].
constexpr double settling = 0.3;

void add_pixels(std::vector<std::uint32_t>& pixels, const std::vector<std::uint32_t>& more) {
    std::vector<std::uint32_t> all;
    std::ranges::set_union(pixels, more, std::back_inserter(all));
    pixels = std::move(all);
}

}  // namespace

std::vector<std::uint32_t> device_pixels(render::Fluoroscope& fluoroscope, const Pulse& pulse,
                                         const PulsedDevice& device) {
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    std::vector<std::uint32_t> pixels = fluoroscope.device_pixels(pulse.arm, device.seen(), shift);
    for (const PulsedTube& filling : device.filling)
        add_pixels(pixels, fluoroscope.device_pixels(pulse.arm, filling.seen(), shift));
    return pixels;
}

std::vector<std::uint32_t> stent_pixels(render::Fluoroscope& fluoroscope, const Pulse& pulse) {
    std::vector<std::uint32_t> pixels;
    for (const PulsedStent& stent : pulse.stents)
        add_pixels(pixels, fluoroscope.device_pixels(pulse.arm, stent.seen(), pulse.exposure.vessel_shift));
    return pixels;
}

Monitor::Monitor(render::Fluoroscope fluoroscope) : fluoroscope_(std::move(fluoroscope)) {}

void Monitor::take(Pulse pulse) {
    const render::Technique technique = fluoroscope_.technique(pulse.arm, pulse.exposure);
    dose_.add(pulse.mode, technique);

    const bool moved = !recent_.empty() && !(recent_.back().pulse.arm == pulse.arm);
    if (!recent_.empty() && !render::same_pose(recent_.back().pulse.arm, pulse.arm))
        moved_ = recent_.back().pulse.time.seconds;
    if (moved || pulse.new_mask) subtraction_.reset();
    // What is subtracted must be as sharp as what it is subtracted from.
    const bool subtracts = pulse.mode == script::ImagingMode::Dsa ||
                           (pulse.mode == script::ImagingMode::Roadmap && subtraction_);
    pulse.exposure.stand_moves = !subtracts && moved_ && pulse.time.seconds - *moved_ < settling - 1e-9;
    if (moved || (!recent_.empty() && recent_.back().pulse.mode != pulse.mode)) recent_.clear();
    const double delivered = technique.delivered * pulse.exposure.detector_dose;
    recent_.push_back({std::move(pulse), delivered, {}});
    if (recent_.size() > remembered) recent_.pop_front();
    image_.reset();

    Recent& last = recent_.back();
    if (last.pulse.mode != script::ImagingMode::Dsa) return;
    if (!subtraction_)
        subtraction_.emplace(signal(last), fluoroscope_.opening(last.pulse.arm),
                             fluoroscope_.scatter_in(signal(last), last.pulse.arm, last.pulse.exposure));
    else
        subtraction_->opacify(signal(last));
}

const render::Field& Monitor::signal(Recent& recent) {
    if (!recent.signal) {
        const Pulse& pulse = recent.pulse;
        recent.signal = fluoroscope_.read(pulse.arm, pulse.seen(), pulse.exposure);
        const auto per_dose = static_cast<float>(1.0 / recent.dose);
        for (float& value : recent.signal->values) value *= per_dose;
    }
    return *recent.signal;
}

namespace {

/// Mixes the next image into those before, by `lag` of them where nothing has moved. Motion is looked for in
/// squares of a few pixels: where the mean of one differs by more than noise can, the filter lets go of what
/// was there, so that a wire or the border of contrast leaves no trail. `dose`: at the detector, of the next
/// image; both are per nGy [nGy].
class RecursiveFilter {
public:
    RecursiveFilter(render::Field& mixed, float lag) : mixed_(mixed), lag_(lag) {
        across_ = (mixed.width + side - 1) / side;
        down_ = (mixed.height + side - 1) / side;
        own_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
    }

    void take(const render::Field& next, double dose) {
        for (int row = 0; row < down_; ++row) look(next, dose, row);
        const auto width = static_cast<std::size_t>(mixed_.width);
        std::vector<float> of_pixel(width);
        for (int row = 0; row < down_; ++row) {
            // What moves also takes along the squares beside it.
            for (int c = 0; c < across_; ++c) {
                float least = 1;
                for (int r = std::max(0, row - 1); r <= std::min(down_ - 1, row + 1); ++r)
                    for (int k = std::max(0, c - 1); k <= std::min(across_ - 1, c + 1); ++k)
                        least = std::min(least, own_[static_cast<std::size_t>(r * across_ + k)]);
                for (int i = c * side; i < std::min((c + 1) * side, mixed_.width); ++i)
                    of_pixel[static_cast<std::size_t>(i)] = 1 - lag_ * least;
            }
            for (int j = row * side; j < std::min((row + 1) * side, mixed_.height); ++j) {
                float* const mixed = mixed_.values.data() + static_cast<std::size_t>(j) * width;
                const float* const now = next.values.data() + static_cast<std::size_t>(j) * width;
                for (std::size_t i = 0; i < width; ++i) mixed[i] += of_pixel[i] * (now[i] - mixed[i]);
            }
        }
    }

private:
    static constexpr int side = 4;  // of a square [pixels]
    /// Of a square's mean, in standard deviations: no motion below the one, nothing kept above the other.
    static constexpr float none = 3, all = 5;

    /// How much of the mixture each square of a row keeps [-].
    void look(const render::Field& next, double dose, int row) {
        const auto width = static_cast<std::size_t>(mixed_.width);
        std::vector<float> difference(width), sum(width);
        const int last = std::min((row + 1) * side, mixed_.height);
        for (int j = row * side; j < last; ++j) {
            const float* const mixed = mixed_.values.data() + static_cast<std::size_t>(j) * width;
            const float* const now = next.values.data() + static_cast<std::size_t>(j) * width;
            for (std::size_t i = 0; i < width; ++i) {
                difference[i] += now[i] - mixed[i];
                sum[i] += now[i];
            }
        }
        for (int c = 0; c < across_; ++c) {
            float apart = 0, quanta = 0;
            for (int i = c * side; i < std::min((c + 1) * side, mixed_.width); ++i) {
                apart += difference[static_cast<std::size_t>(i)];
                quanta += sum[static_cast<std::size_t>(i)];
            }
            // Quanta of the square have the variance of their number, and those of the mixture less.
            const double expected = std::max(1.0, static_cast<double>(quanta) * dose);
            const auto deviations =
                static_cast<float>(std::abs(apart) * dose / std::sqrt(expected * (1 + 0.5 * lag_)));
            own_[static_cast<std::size_t>(row * across_ + c)] =
                1 - std::clamp((deviations - none) / (all - none), 0.0f, 1.0f);
        }
    }

    render::Field& mixed_;
    float lag_;
    int across_ = 0, down_ = 0;
    std::vector<float> own_;  // what each square keeps [-]
};

}  // namespace

const render::Field& Monitor::with_lag(float dose) {
    const float lag = lag_of(recent_.back().pulse.mode);
    // Weights (1 − lag)·lag^k of the k-th pulse back; the oldest takes the remainder to 1.
    mixed_ = signal(recent_.front());
    RecursiveFilter filter(mixed_, lag);
    for (std::size_t i = 1; i < recent_.size(); ++i) filter.take(signal(recent_[i]), recent_[i].dose);
    for (float& value : mixed_.values) value *= dose;
    return mixed_;
}

bool Monitor::map_is_missing() const {
    return !recent_.empty() && recent_.back().pulse.mode == script::ImagingMode::Roadmap &&
           !(subtraction_ && subtraction_->has_map());
}

bool Monitor::shows_difference() const {
    if (recent_.empty() || !subtraction_) return false;
    const script::ImagingMode mode = recent_.back().pulse.mode;
    return mode == script::ImagingMode::Dsa ||
           (mode == script::ImagingMode::Roadmap && subtraction_->has_map());
}

render::Subtraction::Shift Monitor::mask_shift() const {
    return shows_difference() ? subtraction_->shift() : render::Subtraction::Shift();
}

MaskShift Monitor::shift(const script::ShiftMask& asked) {
    using Mode = script::ShiftMask::Mode;
    MaskShift made;
    made.automatic = asked.mode == Mode::Auto;
    if (!shows_difference()) {
        made.outcome = MaskShift::Outcome::NoMask;
        return made;
    }
    const Pulse& last = recent_.back().pulse;
    const bool roadmap = last.mode == script::ImagingMode::Roadmap;
    render::Subtraction::Shift to{asked.x, asked.y};
    if (asked.mode == Mode::By) {
        to.x += subtraction_->shift().x;
        to.y += subtraction_->shift().y;
    } else if (asked.mode == Mode::Auto) {
        const render::Registration found = subtraction_->registration_with(
            roadmap ? with_lag(1.0f) : signal(recent_.back()), fluoroscope_.measuring_field(last.arm),
            searched_fraction * last.arm.pixels);
        // Hundredths of a pixel are below what noise leaves; a few of them, below what interpolation blurs.
        to = {std::round(found.x * 100) / 100, std::round(found.y * 100) / 100};
        if (geometry::hypot(to.x, to.y) < least_found) to = {};
        if (!found.found) made.outcome = MaskShift::Outcome::NoMatch;
    }
    const double most = script::largest_shift_fraction * last.arm.pixels;
    made.x = std::clamp(to.x, -most, most);
    made.y = std::clamp(to.y, -most, most);
    made.limited = made.x != to.x || made.y != to.y;
    if (made.outcome == MaskShift::Outcome::NoMatch) {
        made.x = subtraction_->shift().x;
        made.y = subtraction_->shift().y;
        return made;
    }
    subtraction_->shift_mask({made.x, made.y}, roadmap);
    image_.reset();
    return made;
}

const render::GrayImage* Monitor::image() {
    if (recent_.empty()) return nullptr;
    if (image_) return &*image_;
    const Pulse& last = recent_.back().pulse;
    if (last.mode == script::ImagingMode::Dsa) {
        image_ = subtraction_->subtracted(signal(recent_.back()));
    } else if (last.mode == script::ImagingMode::Roadmap && !map_is_missing()) {
        image_ = subtraction_->roadmap(with_lag(1.0f));
    } else {
        const auto dose = static_cast<float>(recent_.back().dose);
        image_ = fluoroscope_.display(last.arm, last.exposure).show(with_lag(dose));
    }
    return &*image_;
}

void Monitor::store_reference() {
    if (const render::GrayImage* shown = image()) reference_ = *shown;
}

void Monitor::clear() {
    recent_.clear();
    moved_.reset();
    subtraction_.reset();
    image_.reset();
    reference_.reset();
    dose_ = {};
}

}  // namespace exercise
