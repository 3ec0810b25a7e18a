/// Frames repeat byte for byte: from run to run, and for any number of the rasteriser's threads. What the
/// processor alone computes is the same in every build, and is checked against its hash here.

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "physics/geometry/random.h"
#include "render/panel/panel.h"
#include "render/patient/solids.h"
#include "render/xray/contrast.h"
#include "render/xray/detector.h"
#include "render/xray/display.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/path_length.h"
#include "render/xray/subtraction.h"
#include "render/xray/wire_image.h"

namespace {

using geometry::Polyline;
using geometry::Vec3;
using render::Field;
using render::GrayImage;

template <class T>
std::uint64_t hash_of(const std::vector<T>& values) {
    return geometry::fnv1a({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

/// A field of whole numbers from `low` up, without a pattern.
Field uneven(int side, float low, int steps) {
    Field field(side, side);
    for (std::size_t i = 0; i < field.values.size(); ++i)
        field.values[i] = low + static_cast<float>((i * 2654435761u >> 7) % steps);
    return field;
}

Polyline bent_wire() {
    Polyline joints;
    for (int i = 0; i <= 60; ++i) joints.emplace_back(i - 30.0, 0.01 * i * i - 18.0, 0.5 * i - 15.0);
    return joints;
}

render::CArm pinned_arm() {
    return render::CArm{.lao = 0.25, .detector_width = 120.0, .pixels = 96};
}

std::vector<render::TissueLayer> pinned_phantom() {
    return {{"trunk", render::Material::SoftTissue, render::Material::Air,
             render::ellipsoid(Vec3::Zero(), Vec3(150, 100, 200), 48), false},
            {"bone", render::Material::CorticalBone, render::Material::SoftTissue,
             render::ellipsoid(Vec3(25, 20, 0), Vec3(12, 12, 40)), false},
            {"vessel", render::Material::Blood, render::Material::SoftTissue,
             render::tube({{-40, 0, -20}, {40, 5, 10}}, Vec3::UnitZ(), {5, 4}, {5, 4}), true}};
}

/// Everything that GL has a part in: path lengths, a frame, the panel.
std::string picture_hashes() {
    render::PathLengthRenderer renderer;
    const int mesh = renderer.add(render::ellipsoid(Vec3(5, 3, -8), Vec3(40, 20, 30), 60));
    const Field length = renderer.render(mesh, pinned_arm()).length;
    render::Fluoroscope scope({}, pinned_phantom());
    render::Exposure exposure{.iodine = 60.0};
    const GrayImage frame = scope.expose(pinned_arm(), bent_wire(), exposure);
    render::PanelSpec spec;
    spec.width = 640;
    spec.height = 512;
    const render::ColourImage panel = render::Panel(spec).draw(frame, &frame, {});
    return std::to_string(hash_of(length.values)) + " " + std::to_string(hash_of(frame.pixels)) + " " +
           std::to_string(hash_of(panel.pixels));
}

constexpr const char* hashes_of_a_child = "SELDINGER_PRINTS_HASHES";

/// The same in a process of its own: the rasteriser reads its settings once, before the first context. Where
/// the tests run in shards, it runs this test whatever shard that is in.
std::string hashes_of_a_run(const std::string& environment) {
    const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
    const std::string command =
        "env -u GTEST_TOTAL_SHARDS -u GTEST_SHARD_INDEX " + environment + " " + hashes_of_a_child + "=1 '" +
        program + "' --gtest_color=no --gtest_filter=Determinism.PicturesAreTheSame* 2>/dev/null";
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> output(::popen(command.c_str(), "r"), ::pclose);
    std::string text;
    std::array<char, 256> piece{};
    while (output && std::fgets(piece.data(), static_cast<int>(piece.size()), output.get()) != nullptr)
        text += piece.data();
    const std::string mark = "hashes: ";
    const std::size_t from = text.find(mark);
    if (from == std::string::npos) return "none from: " + command;
    return text.substr(from + mark.size(), text.find('\n', from) - from - mark.size());
}

TEST(Determinism, PicturesAreTheSameFromRunToRunAndForAnyNumberOfThreads) {
    const std::string own = picture_hashes();
    if (std::getenv(hashes_of_a_child) != nullptr) {  // a child of this very test
        std::printf("hashes: %s\n", own.c_str());
        return;
    }
    EXPECT_EQ(own, picture_hashes());
    for (const char* environment : {"LP_NUM_THREADS=0 MESA_SHADER_CACHE_DISABLE=true",
                                    "LP_NUM_THREADS=1 MESA_SHADER_CACHE_DISABLE=true",
                                    "LP_NUM_THREADS=2 MESA_SHADER_CACHE_DISABLE=true"})
        EXPECT_EQ(hashes_of_a_run(environment), own) << environment;
}

// A hash that changes without a reason named by the commit is a fault. With -ffp-contract=off it was the same
// at -O0, -O2 and -O3, for x86-64-v3, and from the C library with and without fused arithmetic.

TEST(Determinism, OfTheDetector) {
    const Field few = render::read_out(uneven(96, 1.0f, 40), 0.29, {}, 3, 14);
    EXPECT_EQ(hash_of(few.values), 0x48DCFF5D4D5835BBull);
    const Field many = render::read_out(uneven(96, 200.0f, 4000), 0.15, {0.3, 5.0}, 3, 15);
    EXPECT_EQ(hash_of(many.values), 0xAAC25F573E5C70B4ull);
}

TEST(Determinism, OfTheDisplay) {
    const Field expected = uneven(96, 20.0f, 60), flat(96, 96, 1.0f), weight(96, 96, 1.0f);
    const render::DisplaySpec spec;
    const render::Display display(spec, expected, flat, weight, render::shutters(spec, pinned_arm()));
    EXPECT_EQ(hash_of(display.show(uneven(96, 5.0f, 120)).pixels), 0xEE39005E78DB4BF6ull);
}

TEST(Determinism, OfSubtractionAndRoadmap) {
    render::Subtraction subtraction(uneven(96, 900.0f, 200), Field(96, 96, 1.0f));
    const Field later = uneven(96, 500.0f, 600);
    EXPECT_EQ(hash_of(subtraction.subtracted(later).pixels), 0x2A3A341F5759B923ull);
    subtraction.opacify(later);
    EXPECT_EQ(hash_of(subtraction.roadmap(uneven(96, 800.0f, 300)).pixels), 0x1154C26069399BCDull);
}

TEST(Determinism, OfTheWire) {
    const render::EnergyBins bins = render::fit_bins(render::detected_spectrum(74.0));
    const render::WireLook look;
    render::WireImage wire;
    std::vector<float> transmission;
    std::vector<std::uint32_t> pixels;
    for (const render::WirePixel& pixel :
         wire.cast(pinned_arm(), bent_wire(), look, render::wire_attenuation(look, bins, {}))) {
        pixels.push_back(pixel.index);
        transmission.insert(transmission.end(), pixel.transmission.begin(), pixel.transmission.end());
    }
    EXPECT_EQ(hash_of(pixels), 0x9D745130759221FCull);
    EXPECT_EQ(hash_of(transmission), 0xBDE9F51BF9FD907Bull);
}

TEST(Determinism, OfContrast) {
    std::vector<Vec3> nodes;
    for (int i = 0; i <= 40; ++i) nodes.emplace_back(2.0 * i - 40.0, 0.125 * i, 0.75 * i - 20.0);
    const render::LumenContrast lumen(pinned_phantom().back().mesh, nodes,
                                      std::vector<float>(nodes.size(), 5.0f));
    const render::ContrastMatrix matrix = lumen.at(pinned_arm());
    EXPECT_EQ(hash_of(matrix.pixels), 0x4580EEB9CF5EE3B3ull);
    EXPECT_EQ(hash_of(matrix.lengths), 0x0FE0B2C736FF7837ull);
    std::vector<float> iodine;
    std::vector<render::PixelShift> shifts;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        iodine.push_back(static_cast<float>(i % 7) * 25.0f);
        shifts.push_back({0.25f * static_cast<float>(i % 5), -0.5f});
    }
    Field thickness;
    render::iodine_thickness(matrix, iodine, thickness);
    EXPECT_EQ(hash_of(thickness.values), 0x7BDB0DD1A3E2BC7Eull);
    render::iodine_thickness(matrix, iodine, shifts, thickness);
    EXPECT_EQ(hash_of(thickness.values), 0xFC29CAB9E50D0876ull);
}

}  // namespace
