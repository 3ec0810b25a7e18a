#include "render/panel/panel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <imgui/imgui.h>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "render/panel/canvas.h"
#include "render/panel/contact_sheet.h"
#include "render/panel/palette.h"
#include "render/panel/readout_column.h"
#include "render/patient/solids.h"
#include "render/xray/fluoroscope.h"
#include "tests/engine/fixtures.h"
#include "tests/render/images.h"

namespace {

namespace fs = std::filesystem;
using render::ColourImage;
using render::GrayImage;
using render::Ink;
using render::Panel;
using render::PanelArea;
using render::PanelSpec;
using render::Readout;
using test::noisy, test::plain;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Readout sample() {
    Readout r;
    r.title = "Renal artery";
    r.time = 12.4;
    r.frame = 186;
    r.lao = 0.5;
    r.sid = 1100.0;
    r.sod = 750.0;
    r.field_of_view = 400.0;
    r.pulse_rate = 15.0;
    r.tube_voltage = 74.0;
    r.tube_current = 52.0;
    r.pulse_width = 6.0;
    r.detector_dose = 30.0;
    r.air_kerma = 41.7;
    r.air_kerma_rate = 12.3;
    r.kerma_area = 6.12;
    r.fluoro_time = 258.0;
    r.devices = {{"wire", 420.0, 800.0, 0.7, 0.42, 0.31, 100.0, 0.2}};
    r.tip_to_target = 23.5;
    r.tip_force = 0.06;
    r.largest_wall_force = 0.21;
    r.force_history = {0.1, 0.2, 0.15, 0.21};
    r.contrast = 12.0;
    r.contrast_limit = 100.0;
    r.messages = {{"Wire stopped", render::Notice::Warning}};
    return r;
}

/// Pixels [left, right) × [top, bottom); empty when nothing changed.
struct Changed {
    int left = 1 << 20, top = 1 << 20, right = 0, bottom = 0;
    bool empty() const { return right <= left; }
    bool meets(const Changed& o) const {
        return left < o.right && o.left < right && top < o.bottom && o.top < bottom;
    }
};
Changed changed(const ColourImage& a, const ColourImage& b) {
    Changed c;
    for (int j = 0; j < a.height; ++j) {
        for (int i = 0; i < a.width; ++i) {
            const std::size_t at = 3 * (static_cast<std::size_t>(j) * a.width + i);
            if (std::equal(&a.pixels[at], &a.pixels[at] + 3, &b.pixels[at])) continue;
            c = {std::min(c.left, i), std::min(c.top, j), std::max(c.right, i + 1),
                 std::max(c.bottom, j + 1)};
        }
    }
    return c;
}

int count(const ColourImage& image, Ink ink, const PanelArea& area) {
    int n = 0;
    for (int j = area.top; j < area.top + area.height; ++j) {
        for (int i = area.left; i < area.left + area.width; ++i) {
            const std::uint8_t* p = &image.pixels[3 * (static_cast<std::size_t>(j) * image.width + i)];
            n += p[0] == ink.red && p[1] == ink.green && p[2] == ink.blue;
        }
    }
    return n;
}

/// One panel for all: the first draw compiles shaders.
class PanelTest : public testing::Test {
protected:
    static void SetUpTestSuite() { panel_ = std::make_unique<Panel>(); }
    static void TearDownTestSuite() { panel_.reset(); }

    static ColourImage draw(const Readout& r) { return panel_->draw(live_, nullptr, r); }

    static std::unique_ptr<Panel> panel_;
    static inline const GrayImage live_ = plain(512, 512, 96);
    static inline const PanelArea left_{0, 0, 1024, 1024}, column_{1024, 0, 256, 1024};
};
std::unique_ptr<Panel> PanelTest::panel_;

TEST_F(PanelTest, RefusesSizesItCannotDraw) {
    for (const auto& [width, height] : {std::pair{0, 0}, {1280, 0}, {100000, 100000}, {-5, 1024}, {320, 200}})
        test::expect_refusal<std::invalid_argument>(
            [&] {
                Panel({width, height, {}});
            },
            std::to_string(width) + "x" + std::to_string(height));
    EXPECT_THROW(panel_->draw({}, nullptr, {}), std::invalid_argument);
    EXPECT_THROW(panel_->draw({2, 2, {1, 2, 3}}, nullptr, {}), std::invalid_argument);
    const GrayImage empty;
    EXPECT_THROW(panel_->draw(live_, &empty, {}), std::invalid_argument);
    EXPECT_NO_THROW(draw({})) << "a refusal leaves the panel usable";
}

TEST_F(PanelTest, ShowsTheLiveImageUnalteredAtItsOwnSize) {
    const GrayImage live = noisy(1024, 1024);
    const PanelArea area = panel_->live_area(1024, 1024);
    ASSERT_EQ(area.width, 1024);
    ASSERT_EQ(area.height, 1024);
    const ColourImage screen = panel_->draw(live, nullptr, sample());
    int altered = 0;
    for (int j = 0; j < 1024; ++j) {
        for (int i = 0; i < 1024; ++i) {
            const std::uint8_t grey = live.pixels[static_cast<std::size_t>(j) * 1024 + i];
            const std::uint8_t* p =
                &screen.pixels[3 * (static_cast<std::size_t>(area.top + j) * screen.width + area.left + i)];
            const bool same = p[0] == grey && p[1] == grey && p[2] == grey;
            altered += !same;
            // Marks stand along the edges.
            const bool amid = i >= 60 && i < 964 && j >= 60 && j < 964;
            ASSERT_TRUE(same || !amid) << "column " << i << ", row " << j;
        }
    }
    EXPECT_GT(altered, 0) << "the marks are there";
    EXPECT_LT(altered, 1024 * 1024 / 50);
}

TEST_F(PanelTest, KeepsTheShapeOfImagesOfOtherSizes) {
    for (const auto& [width, height] :
         {std::pair{300, 200}, {200, 300}, {2048, 2048}, {1, 1}, {1025, 1025}}) {
        const PanelArea area = panel_->live_area(width, height);
        EXPECT_NEAR(double(area.width) / area.height, double(width) / height,
                    2.0 / std::min(area.width, area.height));
        EXPECT_TRUE(area.width == 1024 || area.height == 1024);
        const ColourImage screen = panel_->draw(plain(width, height, 173), nullptr, sample());
        // A row and a column through the middle, clear of the marks.
        for (int k = 100; k < 924; ++k) {
            for (const auto& [i, j] : {std::pair{k, 700}, {700, k}}) {
                const bool inside = i >= area.left && i < area.left + area.width && j >= area.top &&
                                    j < area.top + area.height;
                ASSERT_EQ(screen.pixels[3 * (static_cast<std::size_t>(j) * screen.width + i)],
                          inside ? 173 : 0)
                    << width << "x" << height << " at " << i << ", " << j;
            }
        }
    }
}

TEST_F(PanelTest, TheSameStateGivesTheSameBytesWhateverCameBefore) {
    const GrayImage live = noisy(512, 512), stored = noisy(300, 300);
    const ColourImage once = panel_->draw(live, &stored, sample());
    Readout other = sample();
    other.beam_on = true;
    other.lao = -0.3;
    EXPECT_NE(panel_->draw(stored, &live, other), once);
    EXPECT_EQ(panel_->draw(live, &stored, sample()), once);
    Panel another;
    EXPECT_EQ(another.draw(live, &stored, sample()), once);
    EXPECT_FALSE(fs::exists("imgui.ini") || fs::exists("imgui_log.txt"));
}

TEST_F(PanelTest, AReadoutChangesItsOwnPlaceOnly) {
    const ColourImage before = draw(sample());
    const std::vector<std::pair<std::string, std::function<void(Readout&)>>> changes = {
        {"title", [](Readout& r) { r.title = std::string(500, 'W'); }},
        {"time", [](Readout& r) { r.time = 75.0; }},
        {"reference", [](Readout& r) { r.reference_label = std::string(500, 'W'); }},
        {"table",
         [](Readout& r) {
             r.table = {1.0, 2.0, 900.0};
         }},
        {"kV", [](Readout& r) { r.tube_voltage = 1e30; }},
        {"mA", [](Readout& r) { r.tube_current = 81.0; }},
        {"kerma", [](Readout& r) { r.air_kerma = 2999.0; }},
        {"kerma rate", [](Readout& r) { r.air_kerma_rate = 1e30; }},
        {"kerma-area product", [](Readout& r) { r.kerma_area = 200.0; }},
        {"fluoro time", [](Readout& r) { r.fluoro_time = 5000.0; }},
        {"inserted", [](Readout& r) { r.devices[0].inserted = 799.0; }},
        {"tip to target", [](Readout& r) { r.tip_to_target = 1e30; }},
        {"torque", [](Readout& r) { r.devices[0].torque = -1e30; }},
        {"twist", [](Readout& r) { r.devices[0].hub_twist = -1e5; }},
        {"push", [](Readout& r) { r.devices[0].push_force = -0.5; }},
        {"grip", [](Readout& r) { r.devices[0].grip = 1e30; }},
        {"tip force", [](Readout& r) { r.tip_force = 1e30; }},
        {"wall force", [](Readout& r) { r.largest_wall_force = 0.8; }},
        {"history",
         [](Readout& r) {
             r.force_history = {1e30, 0.0, not_a_number, 5.0, 0.0};
         }},
        {"contrast", [](Readout& r) { r.contrast = 1e30; }},
        {"injection", [](Readout& r) { r.injection_rate = 1e30; }},
        {"messages", [](Readout& r) {
             r.messages.assign(99, {std::string(500, 'W'), {}});
         }}};
    std::vector<Changed> places;
    for (const auto& [name, change] : changes) {
        Readout after = sample();
        change(after);
        const Changed place = changed(before, draw(after));
        ASSERT_FALSE(place.empty()) << name;
        const bool on_image = name == "title" || name == "time";
        EXPECT_TRUE(on_image ? place.right <= 1024 : place.left >= 1024 + 8)
            << name << " from " << place.left;
        EXPECT_LT(place.bottom - place.top, name == "messages" ? 130 : 60) << name;
        for (std::size_t k = 0; k < places.size(); ++k) {
            // The dial stands beside three rows.
            EXPECT_FALSE(place.meets(places[k]) && name != "twist" && changes[k].first != "twist")
                << name << " and " << changes[k].first << " around row " << place.top;
        }
        places.push_back(place);
    }
}

TEST_F(PanelTest, PressureStandsBetweenContrastAndMessagesOfADeviceThatHasIt) {
    Readout r = sample();
    const ColourImage none = draw(r);
    r.heart_rate = 70;
    r.pressure_history = {80, 120, not_a_number, 90};
    EXPECT_EQ(draw(r), none) << "without a device";
    r.pressure_of = "catheter";
    const ColourImage dashes = draw(r);
    r.pressure = 101;
    r.systolic = 120;
    r.diastolic = 80;
    r.mean_pressure = 93;
    const Changed section = changed(none, dashes), numbers = changed(dashes, draw(r));
    ASSERT_FALSE(section.empty() || numbers.empty());
    EXPECT_GE(section.left, 1024 + 8);
    EXPECT_GE(numbers.top, section.top - 2);  // digits are higher than dashes
    EXPECT_LT(numbers.bottom, section.bottom);
    EXPECT_LT(numbers.bottom - numbers.top, 45);
    // A column without the reference image has room for the curves.
    render::Canvas tall(256, 1000, 1.0f, render::font_folder());
    const auto column = [&] { return tall.draw([&] { render::draw_readouts(tall, {0, 0, 256, 1000}, r); }); };
    const ColourImage with_gap = column();
    r.pressure_history[2] = 85;
    const Changed gap = changed(with_gap, column());
    EXPECT_GT(gap.right - gap.left, 100);  // over two thirds of the 4 s
    EXPECT_GT(gap.bottom - gap.top, 5);
}

TEST_F(PanelTest, ShowsWhetherTheBeamIsOn) {
    Readout r = sample();
    const ColourImage off = draw(r);
    EXPECT_EQ(count(off, render::palette::beam, left_), 0);
    EXPECT_EQ(count(off, render::palette::beam, column_), 0);
    r.beam_on = true;
    const ColourImage on = draw(r);
    EXPECT_GT(count(on, render::palette::beam, left_), 100) << "LIVE and the sign of radiation";
    EXPECT_GT(count(on, render::palette::beam, column_), 20) << "the source of the pictogram";
}

TEST_F(PanelTest, ThePictogramsTurnAsTheArmDoes) {
    // The source is opposite the detector, and alone yellow in the left half of the column.
    const auto source_column = [](double lao, double cranial, bool right_half) {
        Readout r = sample();
        r.lao = lao;
        r.cranial = cranial;
        r.beam_on = true;
        const ColourImage screen = draw(r);
        double sum = 0.0;
        int pixels = 0;
        for (int i = right_half ? 1152 : 1024; i < (right_half ? 1280 : 1152); ++i) {
            const int here = count(screen, render::palette::beam, {i, 0, 1, 1024});
            sum += double(here) * i;
            pixels += here;
        }
        EXPECT_GT(pixels, 20);
        return sum / pixels;
    };
    const double straight = source_column(0.0, 0.0, false);
    EXPECT_LT(source_column(0.5, 0.0, false), straight - 10.0) << "LAO: detector to the patient's left";
    EXPECT_GT(source_column(-0.5, 0.0, false), straight + 10.0);
    EXPECT_GT(source_column(0.0, 0.5, true), source_column(0.0, 0.0, true) + 5.0)
        << "cranial: source to the feet";
}

TEST_F(PanelTest, DoseIsColouredUpToTheNotificationLevel) {
    namespace ink = render::palette;
    const auto shown = [](double kerma) {
        Readout r = sample();
        r.messages.clear();
        r.air_kerma = kerma;
        return draw(r);
    };
    const auto at = [](double fraction) { return fraction * render::DoseNotification::air_kerma; };
    EXPECT_EQ(count(shown(at(0.49)), ink::caution, column_), 0);
    EXPECT_GT(count(shown(at(0.51)), ink::caution, column_), 100);
    EXPECT_EQ(count(shown(at(0.99)), ink::alarm, column_), 0);
    EXPECT_GT(count(shown(at(1.0)), ink::alarm, column_), 500);
    EXPECT_GT(count(shown(at(0.45)), ink::calm, column_), count(shown(at(0.1)), ink::calm, column_) + 100)
        << "the bar grows";
}

TEST_F(PanelTest, ValuesThatAreNotNumbersAreShownAsIfMissing) {
    Readout missing, broken;
    for (double* angle : {&missing.lao, &missing.cranial, &broken.lao, &broken.cranial})
        *angle = not_a_number;
    for (auto field :
         {&Readout::time, &Readout::sid, &Readout::sod, &Readout::field_of_view, &Readout::pulse_rate,
          &Readout::tube_voltage, &Readout::tube_current, &Readout::pulse_width, &Readout::detector_dose,
          &Readout::air_kerma, &Readout::air_kerma_rate, &Readout::kerma_area, &Readout::fluoro_time,
          &Readout::contrast_limit, &Readout::tip_to_target, &Readout::tip_force,
          &Readout::largest_wall_force, &Readout::contrast}) {
        broken.*field = not_a_number;
    }
    broken.devices = {{"wire", not_a_number, not_a_number, not_a_number, not_a_number, not_a_number,
                       not_a_number, not_a_number}};
    EXPECT_EQ(draw(broken), draw(missing));
    EXPECT_NE(draw(missing), draw(sample()));

    constexpr double infinity = std::numeric_limits<double>::infinity();
    for (const double odd : {not_a_number, infinity, -infinity, 1e308, -1e308, 1e-320, -0.0}) {
        Readout r = sample();
        r.lao = r.cranial = r.force_limit = r.history_length = r.injection_rate = odd;
        r.sid = r.sod = r.contrast_limit = r.contrast = odd;
        r.devices = {{"wire", odd, odd, odd, odd, odd, odd, odd}};
        r.table = {odd, odd, odd};
        r.force_history = {odd, 0.1, odd, 0.2, 0.3, odd};
        EXPECT_NO_THROW(draw(r)) << odd;
    }
}

TEST_F(PanelTest, TakesAnyBytesAsTextAndAnyLength) {
    Readout r = sample();
    const ColourImage before = draw(r);
    r.title = "\xff\xfe" + std::string(100000, 'x') + "\xc3";
    r.mode = "%s%n\n\t\x01";
    r.reference_label = std::string(3, '\0');
    r.force_history.assign(200000, 0.3);
    r.messages = {{"λ – ° 血管", {}}, {"", {}}, {"\xf0\x9f", {}}, {std::string(100000, ' '), {}}};
    ColourImage after;
    EXPECT_NO_THROW(after = draw(r));
    EXPECT_NE(after, before);
}

TEST_F(PanelTest, DrawsWithoutTheFontOrWithABrokenOne) {
    const test::TemporaryFolder folder;
    const fs::path installed = render::PanelSpec{}.fonts;
    EXPECT_EQ(panel_->has_font(),
              fs::exists(installed / "DejaVuSans.ttf") && fs::exists(installed / "DejaVuSans-Bold.ttf"));
    Panel bare({1280, 1024, folder.path()});
    EXPECT_FALSE(bare.has_font());
    const ColourImage coarse = bare.draw(live_, nullptr, sample());
    EXPECT_EQ(coarse.pixels.size(), std::size_t{3} * 1280 * 1024);
    if (panel_->has_font()) {
        EXPECT_NE(coarse, draw(sample()));
        // The header of a font whose tables are cut off.
        for (const char* name : {"DejaVuSans.ttf", "DejaVuSans-Bold.ttf"}) {
            fs::copy_file(installed / name, folder / name);
            fs::resize_file(folder / name, 20000);
        }
        EXPECT_FALSE(Panel({640, 512, folder.path()}).has_font());
    }
}

TEST_F(PanelTest, LeavesAnotherImGuiAndTheFluoroscopeAsTheyWere) {
    ImGuiContext* window = ImGui::CreateContext();
    ImGui::SetCurrentContext(window);
    draw(sample());
    { Panel passing({640, 512, {}}); }
    EXPECT_EQ(ImGui::GetCurrentContext(), window);
    ImGui::DestroyContext(window);

    render::CArm arm{.pixels = 64};
    const auto scope = [] {
        std::vector<render::TissueLayer> layers;
        layers.push_back({"ball", render::Material::SoftTissue, render::Material::Air,
                          render::ellipsoid(geometry::Vec3::Zero(), {60, 60, 60}), false});
        return render::Fluoroscope({}, std::move(layers));
    };
    auto alone = scope(), beside = scope();
    beside.expose(arm, {}, {});
    draw(sample());
    arm.lao = 0.4;
    const GrayImage frame = beside.expose(arm, {}, {});
    EXPECT_EQ(frame, alone.expose(arm, {}, {}));
    const ColourImage screen = panel_->draw(frame, nullptr, sample());
    EXPECT_EQ(screen, Panel().draw(frame, nullptr, sample()));
}

TEST_F(PanelTest, ManyThreadsDrawWhatOneDraws) {
    // Dear ImGui has one current context for the whole process.
    const Readout readout = sample();
    const ColourImage expected = Panel({640, 512, PanelSpec().fonts}).draw(live_, nullptr, readout);
    const std::vector<GrayImage> tiles(3, live_);
    const std::vector<std::string> labels = {"one", "two", "three"};
    const GrayImage expected_sheet = render::contact_sheet(tiles, 2, 96, labels);
    std::atomic<int> different = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            std::optional<Panel> kept;
            for (int k = 0; k < 25; ++k) {
                if (k % 4 == 0) kept.emplace(PanelSpec{640, 512, PanelSpec().fonts});
                different += kept->draw(live_, nullptr, readout) != expected;
                different += render::contact_sheet(tiles, 2, 96, labels) != expected_sheet;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(different, 0);
}

}  // namespace
