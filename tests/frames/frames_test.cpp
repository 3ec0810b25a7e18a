/// Golden frames: each folder tests/frames/CASE is a scenario, its commands, a few frames and the score they
/// must give. README.md in this folder explains how a golden is changed.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "engine/io/text.h"
#include "engine/run/headless.h"
#include "engine/run/picture_file.h"
#include "render/picture/png.h"
#include "tests/anatomies.h"
#include "tests/frames/comparison.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using render::GrayImage;
using test::Measures;

json read_json(const fs::path& path) {
    std::ifstream file(path);
    return json::parse(file);
}

class Frames : public testing::TestWithParam<std::string> {
protected:
    const fs::path folder = fs::path(SELDINGER_SOURCE) / "tests/frames" / GetParam();
    const fs::path output = fs::path(SELDINGER_FRAME_OUTPUT) / GetParam();
    const bool update = std::getenv("SELDINGER_UPDATE_GOLDENS") != nullptr;
    const json settings = read_json(folder / "limits.json");
    const Measures limits = settings.at("limits").get<Measures>();
    const std::vector<int> golden_frames = settings.at("golden_frames").get<std::vector<int>>();
    const scenario::Scenario scenario =
        scenario::load_scenario(folder / "scenario.toml", SELDINGER_SOURCE "/assets/devices");
    const script::CommandScript script = script::load_commands(folder / "commands.gw");
};

std::vector<std::string> cases() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(fs::path(SELDINGER_SOURCE) / "tests/frames"))
        if (entry.is_directory()) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

using Change = std::function<void(exercise::Pulse&)>;
using Images = std::map<int, GrayImage>;  // by frame

/// A script as it is played, and the screen as it would look with other pulses.
class Replay {
public:
    Replay(const scenario::Scenario& scenario, const script::CommandScript& script, std::vector<int> frames)
        : frames_(std::move(frames)) {
        exercise::Exercise exercise(scenario, true, test::cache());
        auto next = script.commands.begin();
        for (int frame = 0; frame <= frames_.back(); ++frame) {
            std::vector<script::Command> commands;
            for (; next != script.commands.end() && next->frame == frame; ++next)
                commands.push_back(next->command);
            exercise.next_frame(commands);
            const exercise::Pulse* pulse = exercise.monitor()->last_pulse();
            if (pulse && pulse->time.index == frame) pulses_.push_back(*pulse);
            if (std::binary_search(frames_.begin(), frames_.end(), frame))
                truth_.emplace(frame, exercise.truth());
        }
        const exercise::Simulation& simulation = exercise.simulation();
        monitor_.emplace(
            exercise::make_imaging(simulation.scenario(), simulation.anatomy(), simulation.contrast())
                .fluoroscope);
    }

    Images images(const Change& change) {
        Images images;
        monitor_->clear();
        auto next = pulses_.begin();
        for (const int frame : frames_) {
            for (; next != pulses_.end() && next->time.index <= frame; ++next) {
                exercise::Pulse pulse = *next;
                change(pulse);
                monitor_->take(std::move(pulse));
            }
            images[frame] = *monitor_->image();
        }
        return images;
    }
    const exercise::Truth& truth(int frame) const { return truth_.at(frame); }

private:
    std::vector<int> frames_;
    std::vector<exercise::Pulse> pulses_;
    std::map<int, exercise::Truth> truth_;
    std::optional<exercise::Monitor> monitor_;
};

/// The wire moved in the image by this many pixels.
void shift_wire(exercise::Pulse& pulse, double right, double down) {
    const render::ArmAxes axes = render::axes(pulse.arm);
    const double pixel = render::pixel_width(pulse.arm) * pulse.arm.sod / pulse.arm.sid;
    for (geometry::Vec3& joint : pulse.devices[0].joints)
        joint += pixel * (right * axes.right - down * axes.up);
}

/// The image with a part of the wire's shadow taken away from each pixel.
template <class Part>
GrayImage without(const GrayImage& image, const GrayImage& wireless, const Part& part_of) {
    GrayImage changed = image;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double shadow = static_cast<double>(image.pixels[i]) - wireless.pixels[i];
        changed.pixels[i] = static_cast<std::uint8_t>(std::lround(image.pixels[i] - part_of(i) * shadow));
    }
    return changed;
}

GrayImage with_gamma(const GrayImage& image, double gamma) {
    GrayImage changed = image;
    for (std::uint8_t& grey : changed.pixels)
        grey = static_cast<std::uint8_t>(std::lround(255 * std::pow(grey / 255.0, gamma)));
    return changed;
}

/// Mean change that the wire makes to the image over its pixels [grey levels].
double contrast(const GrayImage& image, const GrayImage& wireless, const GrayImage& wire) {
    return test::compare(image, wireless, wire).at("wire_difference");
}

/// Which part of which pixel of the wire's shadow is nearest to a gap in the wire: a segment, or as many as a
/// pixel takes where they are shorter.
using Gap = std::map<std::size_t, double>;
std::vector<Gap> gaps_of(const exercise::Truth& truth) {
    const exercise::Pulse& pulse = truth.pulse;
    std::vector<Eigen::Vector2d> places;
    for (const geometry::Vec3& joint : pulse.devices[0].joints) {
        const render::Pixel pixel = render::project(pulse.arm, joint + pulse.exposure.vessel_shift);
        places.emplace_back(pixel.x, pixel.y);
    }
    const std::size_t segments = places.size() - 1;
    const auto away = [&](const Eigen::Vector2d& place, std::size_t segment) {
        const Eigen::Vector2d way = places[segment + 1] - places[segment], from = place - places[segment];
        const double along = std::clamp(from.dot(way) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
        return (from - along * way).squaredNorm();
    };
    std::vector<Gap> nearest(segments);
    constexpr int samples = 4;  // along either side of a pixel
    for (std::size_t i = 0; i < truth.devices[0].pixels.size(); ++i) {
        if (truth.devices[0].pixels[i] == 0) continue;
        for (int k = 0; k < samples * samples; ++k) {
            const Eigen::Vector2d place(
                static_cast<double>(i % truth.devices[0].width) + (k % samples + 0.5) / samples,
                static_cast<double>(i / truth.devices[0].width) + (k / samples + 0.5) / samples);
            std::size_t best = 0;
            for (std::size_t segment = 1; segment < segments; ++segment)
                if (away(place, segment) < away(place, best)) best = segment;
            nearest[best][i] += 1.0 / (samples * samples);
        }
    }
    std::vector<Gap> gaps;
    for (std::size_t first = 0; first < segments; ++first) {
        Gap gap;
        double length = 0;
        for (std::size_t segment = first; segment < segments && length < 1; ++segment) {
            length += (places[segment + 1] - places[segment]).norm();
            for (const auto& [pixel, part] : nearest[segment]) gap[pixel] += part;
        }
        if (length >= 1) gaps.push_back(std::move(gap));
    }
    return gaps;
}

/// Of the pixels of the gap.
double contrast(const GrayImage& image, const GrayImage& wireless, const Gap& gap) {
    double sum = 0, area = 0;
    for (const auto& [i, part] : gap) {
        sum += part * std::abs(static_cast<double>(image.pixels[i]) - wireless.pixels[i]);
        area += part;
    }
    return area > 0 ? sum / area : 0;
}

constexpr double clear = 10;  // contrast of a wire that an image shows [grey levels]

}  // namespace

TEST_P(Frames, EqualTheirGoldens) {
    fs::create_directories(output);
    run::RunOptions options;
    options.truth = true;
    options.cache = test::cache();
    run::run_headless(scenario, script, output, options);

    for (const int frame : golden_frames) {
        const std::string name = run::frame_file_name(frame);
        const GrayImage actual = render::read_png(output / "frames" / name);
        if (update) {
            run::write_picture(folder / name, actual);
            continue;
        }
        ASSERT_TRUE(fs::exists(folder / name)) << "no golden " << name << "; see tests/frames/README.md";
        const GrayImage golden = render::read_png(folder / name);
        ASSERT_EQ(golden.width, actual.width);
        ASSERT_EQ(golden.height, actual.height);
        const std::string wire = fs::path(name).stem().string() + "_wire.png";
        const auto wrong =
            test::beyond(limits, test::compare(golden, actual, render::read_png(output / "truth" / wire)));
        if (!wrong.empty()) {
            run::write_picture(output / ("actual_" + name), actual);
            run::write_picture(output / ("difference_" + name), test::difference_image(golden, actual));
        }
        EXPECT_TRUE(wrong.empty()) << name << ": " << io::joined(wrong) << "; look at " << output
                                   << "/actual_* and difference_*";
    }

    const fs::path expected_score = folder / "score.json";
    if (update) {
        fs::copy_file(output / "score.json", expected_score, fs::copy_options::overwrite_existing);
        return;
    }
    const auto wrong = test::score_differences(read_json(expected_score), read_json(output / "score.json"),
                                               settings.at("score_tolerance").get<double>());
    EXPECT_TRUE(wrong.empty()) << io::joined(wrong, "\n");
}

TEST_P(Frames, LimitsRefuseAWrongWireNoiseAndGamma) {
    Replay replay(scenario, script, golden_frames);
    const Images shown = replay.images([](exercise::Pulse&) {});
    const Images wireless = replay.images([](exercise::Pulse& pulse) { pulse.devices[0].joints.clear(); });
    const Images shifted_right = replay.images([](exercise::Pulse& pulse) { shift_wire(pulse, 0.5, 0); });
    const Images shifted_down = replay.images([](exercise::Pulse& pulse) { shift_wire(pulse, 0, 0.5); });
    // Noise goes as one over the root of the dose; the display is adjusted to the dose.
    const Images noisy = replay.images([](exercise::Pulse& p) { p.exposure.detector_dose /= 1.1 * 1.1; });
    // Path lengths and the wire off by a micrometre, as another processor might round them.
    const Images rounded = replay.images([](exercise::Pulse& pulse) {
        pulse.arm.isocentre += geometry::Vec3::Constant(1e-3);
        for (geometry::Vec3& joint : pulse.devices[0].joints) joint -= geometry::Vec3::Constant(1e-3);
    });

    std::vector<int> wire_frames;
    for (const int frame : golden_frames) {
        const GrayImage &image = shown.at(frame), &bare = wireless.at(frame),
                        &wire = replay.truth(frame).devices[0];
        const auto beyond = [&](const GrayImage& mutant, const std::string& what) {
            const Measures found = test::compare(image, mutant, wire);
            RecordProperty(fmt::format("frame_{}_{}", frame, what),
                           fmt::format("tile {:.2f}, wire {:.2f}, bias {:.2f}, largest {:.0f}",
                                       found.at("tile_difference"), found.at("wire_difference"),
                                       found.at("wire_bias"), found.at("wire_largest")));
            return test::beyond(limits, found);
        };
        EXPECT_TRUE(beyond(image, "itself").empty()) << frame;
        const auto rounding = beyond(rounded.at(frame), "rounded");
        EXPECT_TRUE(rounding.empty()) << frame << ": " << io::joined(rounding);
        EXPECT_FALSE(beyond(noisy.at(frame), "noise").empty()) << frame;
        EXPECT_FALSE(beyond(with_gamma(image, 1.02), "gamma").empty()) << frame;

        if (contrast(image, bare, wire) < clear) continue;
        wire_frames.push_back(frame);
        const auto tenth = [&](std::size_t i) { return wire.pixels[i] != 0 ? 0.1 : 0.0; };
        EXPECT_FALSE(beyond(without(image, bare, tenth), "fainter").empty()) << frame;
        EXPECT_FALSE(beyond(shifted_right.at(frame), "right").empty()) << frame;
        EXPECT_FALSE(beyond(shifted_down.at(frame), "down").empty()) << frame;
        int gaps = 0, refused = 0;
        double least = 256;
        for (const Gap& gap : gaps_of(replay.truth(frame))) {
            if (contrast(image, bare, gap) < clear) continue;
            const auto part = [&](std::size_t i) { return gap.contains(i) ? gap.at(i) : 0.0; };
            const Measures found = test::compare(image, without(image, bare, part), wire);
            least = std::min(least, found.at("wire_largest"));
            refused += !test::beyond(limits, found).empty();
            ++gaps;
        }
        EXPECT_GT(gaps, 0) << frame;
        EXPECT_EQ(refused, gaps) << frame;
        RecordProperty(fmt::format("frame_{}_gap", frame),
                       fmt::format("{} gaps, largest at least {:.0f}", gaps, least));
    }
    EXPECT_EQ(wire_frames, settings.at("wire_frames").get<std::vector<int>>());
}

INSTANTIATE_TEST_SUITE_P(Case, Frames, testing::ValuesIn(cases()),
                         [](const auto& which) { return which.param; });

TEST(Comparison, NoticesEveryValueOfAScore) {
    const json flat = read_json(fs::path(SELDINGER_SOURCE) / "tests/frames/s_bend/score.json").flatten();
    const json score = flat.unflatten();  // empty lists are null in it
    EXPECT_TRUE(test::score_differences(score, score, 1e-4).empty());
    ASSERT_TRUE(flat.contains("/max_penetration_at/joint"));
    for (const auto& [path, value] : flat.items()) {
        json other = flat;
        other[path] = value.is_number_float()     ? json(value.get<double>() * 1.001 + 0.001)
                      : value.is_number_integer() ? json(value.get<int>() + 1)
                      : value.is_boolean()        ? json(!value.get<bool>())
                      : value.is_null()           ? json(1.5)
                                                  : json(value.get<std::string>() + "x");
        EXPECT_EQ(test::score_differences(score, other.unflatten(), 1e-4).size(), 1u) << path;
        other.erase(path);
        EXPECT_FALSE(test::score_differences(score, other.unflatten(), 1e-4).empty()) << path;
    }
    json longer = score;
    longer["max_penetration_at"]["more"] = json::array({1, 2});
    EXPECT_EQ(test::score_differences(score, longer, 1e-4).size(), 2u);
}
