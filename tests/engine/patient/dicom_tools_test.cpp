/// Series as scanners and archives write them, made with DCMTK's tools.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "engine/io/wall.h"
#include "engine/patient/ct_image.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/patient/dicom_writer.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;

/// With noise, as compressors meet it. `tilt`: of the gantry [mm a slice].
CtImage scanned(double tilt = 0.0) {
    CtImage ct;
    const geometry::Mat3 turn = Eigen::AngleAxisd(0.25, Vec3(1, 2, -1).normalized()).toRotationMatrix();
    ct.grid.size = {24, 18, 5};
    ct.grid.origin = Vec3(-120.25, 88.5, -430.75);
    ct.grid.steps = {0.7 * turn.col(0), 0.8 * turn.col(1), 1.5 * turn.col(2) + tilt * turn.col(1)};
    std::mt19937 random(7);
    for (std::size_t n = 0; n < ct.grid.count(); ++n) {
        const int i = static_cast<int>(n % 24);
        ct.hu.push_back(
            static_cast<std::int16_t>((i < 4 ? -1000 : 40 * i) + static_cast<int>(random() % 24)));
    }
    return ct;
}

std::vector<fs::path> files_of(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

/// Runs a tool on a file in place: "dcmconv +ti".
void change(const fs::path& file, const std::string& tool) {
    const fs::path to = file.string() + ".new";
    const std::string command = fmt::format("{} {} {} >/dev/null 2>&1", tool, file.string(), to.string());
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    fs::rename(to, file);
}
void modify(const fs::path& file, const std::string& changes) {
    const std::string command = fmt::format("dcmodify -nb {} {} >/dev/null 2>&1", changes, file.string());
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

void expect_as_written(const fs::path& folder, const CtImage& ct, const std::string& what) {
    CtImage read;
    ASSERT_EQ(test::refusal([&] { read = read_ct(folder); }), "") << what;
    EXPECT_EQ(read.grid.size, ct.grid.size) << what;
    EXPECT_LT((read.grid.origin - ct.grid.origin).norm(), 1e-5) << what;
    for (int a = 0; a < 3; ++a) EXPECT_LT((read.grid.steps[a] - ct.grid.steps[a]).norm(), 1e-5) << what;
    EXPECT_EQ(read.hu, ct.hu) << what;
}

bool without_tools() {
    return std::system("dcmcjpls --version >/dev/null 2>&1") != 0;
}

const char* const lossless[] = {"dcmconv +te",  "dcmconv +ti",  "dcmconv +tb",  "dcmconv +td",
                                "dcmcjpeg +e1", "dcmcjpeg +el", "dcmcjpls +el", "dcmcrle"};

}  // namespace

TEST(DicomTools, EverySyntaxOfTransferGivesTheSameVolume) {
    if (without_tools()) GTEST_SKIP() << "dcmcjpls is not installed";
    for (const bool with_sign : {false, true}) {
        for (const double tilt : {0.0, 0.4}) {
            const CtImage ct = scanned(tilt);
            test::DicomSeries series;
            series.with_sign = with_sign;
            for (const char* tool : lossless) {
                const test::TemporaryFolder folder;
                test::write_dicom(folder / "ct", ct, series);
                for (const fs::path& file : files_of(folder / "ct")) change(file, tool);
                expect_as_written(folder / "ct", ct,
                                  fmt::format("{}, sign {}, tilt {}", tool, with_sign, tilt));
            }
        }
    }
}

TEST(DicomTools, WhatLiesBesideASeriesIsLeftOutAndASlopeIsApplied) {
    if (without_tools()) GTEST_SKIP() << "dcmodify is not installed";
    const CtImage ct = scanned();
    const test::TemporaryFolder folder;
    const fs::path of = folder / "ct";
    test::write_dicom(of, ct);
    const fs::path first = files_of(of).front();
    // A survey view of the same series, a picture of the dose report, a report without samples.
    fs::copy_file(first, of / "survey");
    modify(of / "survey",
           "-m ImageType='ORIGINAL\\PRIMARY\\LOCALIZER' -m "
           "ImageOrientationPatient='1\\0\\0\\0\\0\\-1'");
    fs::copy_file(first, of / "picture");
    modify(of / "picture",
           "-m SOPClassUID=1.2.840.10008.5.1.4.1.1.7 -m SeriesInstanceUID=1.2.3 -m BitsAllocated=8 -ea "
           "ImagePositionPatient");
    fs::copy_file(first, of / "report");
    modify(of / "report", "-m SeriesInstanceUID=1.2.4 -ea PixelData");
    fs::copy_file(first, of / "magnetic");
    modify(of / "magnetic", "-m SeriesInstanceUID=1.2.5 -m Modality=MR");
    expect_as_written(of, ct, "with other files");

    // Halved numbers with a slope of 2.
    CtImage even = ct;
    for (std::int16_t& hu : even.hu) hu = static_cast<std::int16_t>(hu / 2 * 2);
    CtImage half = even;
    for (std::int16_t& hu : half.hu) hu = static_cast<std::int16_t>(hu / 2);
    test::DicomSeries series;
    series.with_sign = true;
    test::write_dicom(folder / "slope", half, series);
    for (const fs::path& file : files_of(folder / "slope")) modify(file, "-m RescaleSlope=2");
    expect_as_written(folder / "slope", even, "slope");
}

TEST(DicomTools, WhatIsNoGridSaysWhy) {
    if (without_tools()) GTEST_SKIP() << "dcmodify is not installed";
    const CtImage ct = scanned();
    const auto said = [&](const std::string& changes, bool all = false) {
        const test::TemporaryFolder folder;
        test::write_dicom(folder / "ct", ct);
        for (const fs::path& file : files_of(folder / "ct")) {
            modify(file, changes);
            if (!all) break;
        }
        return test::refusal([&] { read_ct(folder / "ct"); });
    };
    test::expect_said(said("-m PixelSpacing='0.9\\0.9'"), "its size, spacing or orientation is not that of");
    test::expect_said(said("-m ImageOrientationPatient='1\\0\\0\\0\\1\\0'"),
                      "its size, spacing or orientation is not that of");
    test::expect_said(said("-m ImageOrientationPatient='1\\0\\0\\1\\0\\0'"),
                      "two perpendicular unit vectors");
    test::expect_said(said("-m PixelSpacing='0\\0.9'"), "two numbers above 0");
    test::expect_said(said("-i NumberOfFrames=40", true), "40 frames without a place of each were found");
    test::expect_said(said("-ea RescaleSlope"), "RescaleSlope");
    test::expect_said(said("-m RescaleSlope=nan"), "RescaleSlope");
    test::expect_said(said("-ea ImagePositionPatient"), "ImagePositionPatient");
    test::expect_said(said("-m ImagePositionPatient='0\\0\\0'"), "beside the line of the others");
    test::expect_said(said("-m Rows=9"), "its size, spacing or orientation");
    test::expect_said(said("-m Rows=4000", true), "samples were found; expected 24 × 4000");
    test::expect_said(said("-m PhotometricInterpretation=RGB"), "MONOCHROME2");
    test::expect_said(said("-m SamplesPerPixel=3"), "16 bits in one value");
    test::expect_said(said("-m SeriesInstanceUID=1.2.3.4"), "2 series of CT were found");
    test::expect_said(said("-ea SeriesInstanceUID"), "no SeriesInstanceUID");
}

TEST(DicomTools, DamagedSeriesOfEverySyntaxAreReadOrRefused) {
    const io::WithoutWall here;
    if (without_tools()) GTEST_SKIP() << "dcmcjpls is not installed";
    const unsigned seed = 20261123;
    std::printf("seed %u\n", seed);
    std::mt19937 random(seed);
    const CtImage ct = scanned();
    int read = 0, refusals = 0;
    for (const char* tool : lossless) {
        const test::TemporaryFolder folder;
        test::write_dicom(folder / "ct", ct);
        for (const fs::path& file : files_of(folder / "ct")) change(file, tool);
        const fs::path one = files_of(folder / "ct")[2];
        const std::string whole = test::read(one);
        for (int t = 0; t < 250; ++t) {
            std::string text = whole;
            // Half of the damage hits the header, half what follows: the compressed samples.
            const std::size_t header = std::min<std::size_t>(text.size(), 1300);
            const std::size_t from = t % 2 == 0 ? 128 : std::min(header, text.size() - 1);
            const std::size_t reach = t % 2 == 0 ? header : text.size();
            for (int n = static_cast<int>(random() % 8) + 1; n > 0; --n)
                text[from + random() % (reach - from)] = static_cast<char>(random());
            if (random() % 8 == 0) text.resize(random() % text.size());
            test::write(one, text);
            try {
                const CtImage image = read_ct(folder / "ct");
                ++read;
                ASSERT_EQ(image.hu.size(), image.grid.count());
                for (const std::int16_t hu : image.hu) ASSERT_TRUE(hu >= lowest_hu && hu <= highest_hu);
            } catch (const io::InputError&) {
                ++refusals;
            } catch (const std::exception& error) {
                FAIL() << tool << ", seed " << seed << ", try " << t << ": " << error.what();
            }
        }
    }
    EXPECT_GT(read, 100);
    EXPECT_GT(refusals, 100);
}

}  // namespace patient
