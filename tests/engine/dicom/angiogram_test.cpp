/// Angiograms as other programs read them: DCMTK's own tools report no warning and find what was put in.

#include "engine/dicom/angiogram.h"

#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "engine/io/error.h"
#include "tests/engine/fixtures.h"

namespace test {
namespace {

namespace fs = std::filesystem;
using dicom::Angiogram;
using dicom::Pixels;
using dicom::Series;

/// What a program prints on both channels.
std::string printed(const TemporaryFolder& folder, const std::string& command) {
    const fs::path file = folder / "printed";
    const int status = std::system(fmt::format("{} >{} 2>&1", command, file.string()).c_str());
    return fmt::format("{}status {}", read(file), status);
}

bool has_tools() {
    return std::system("dcmdump --version >/dev/null 2>&1") == 0;
}

/// The elements of a file as dcmdump prints them, whole. Fails for a warning or an error.
std::string elements(const TemporaryFolder& folder, const fs::path& file) {
    const std::string all = printed(folder, fmt::format("dcmdump +L {}", file.string()));
    expect_said(all, "status 0");
    for (const char* bad : {"\nW:", "\nE:", "\nF:", "Warning", "Error"})
        EXPECT_EQ(("\n" + all).find(bad), std::string::npos) << all;
    expect_said(printed(folder, fmt::format("dcmftest {}", file.string())), "yes:");
    return all;
}

/// The value that dcmdump prints for a tag.
std::string value_of(const std::string& all, const std::string& tag) {
    const auto line = all.find("(" + tag + ")");
    if (line == std::string::npos) return "absent";
    const auto end = all.find('\n', line), open = all.find_first_of("[=", line);
    if (open > end) {
        const auto word = line + 15;  // after "(gggg,eeee) VR "
        return all.substr(word, all.find(' ', word) - word);
    }
    return all[open] == '=' ? all.substr(open + 1, all.find(' ', open) - open - 1)
                            : all.substr(open + 1, all.rfind(']', end) - open - 1);
}

Series series_of(int pixels) {
    Series series;
    series.program = "tests 1";
    series.patient = "renal";
    series.study = 77;
    series.description = "live, from frame 0";
    series.arm.lao = -30 * geometry::degree;
    series.arm.cranial = 25 * geometry::degree;
    series.arm.pixels = pixels;
    series.frame_rate = 15;
    return series;
}

render::GrayImage noise(int pixels, std::mt19937& random) {
    render::GrayImage image{pixels, pixels, {}};
    for (int i = 0; i < pixels * pixels; ++i)
        image.pixels.push_back(static_cast<std::uint8_t>(std::uniform_int_distribution<int>(0, 255)(random)));
    return image;
}

const render::Technique technique{74, 150, 6, 0.02, 0.0125, 1};

/// The pixels of a file, as dcmdump writes them out.
std::string pixels_of(const TemporaryFolder& folder, const fs::path& file) {
    const fs::path out = folder / "pixels";
    fs::remove_all(out);
    fs::create_directory(out);
    printed(folder, fmt::format("dcmdump +W {} {}", out.string(), file.string()));
    for (const auto& entry : fs::directory_iterator(out)) return read(entry.path());
    ADD_FAILURE() << "no pixels in " << file;
    return {};
}

}  // namespace

using Angiograms = InFolder;

TEST_F(Angiograms, ShowWhatWasPutInToDicomTools) {
    if (!has_tools()) GTEST_SKIP() << "dcmdump is not installed";
    std::mt19937 random(1);
    Angiogram angiogram(series_of(48));
    std::string all;
    for (int frame = 0; frame < 5; ++frame) {
        const render::GrayImage image = noise(48, random);
        angiogram.add(image, technique, 2 + frame / 15.0);
        all.append(image.pixels.begin(), image.pixels.end());
    }
    angiogram.inject(320);
    angiogram.write(folder / "a.dcm");
    EXPECT_EQ(pixels_of(folder, folder / "a.dcm"), all);

    const std::string said = elements(folder, folder / "a.dcm");
    EXPECT_EQ(value_of(said, "0002,0010"), "LittleEndianExplicit");
    EXPECT_EQ(value_of(said, "0008,0016"), "XRayAngiographicImageStorage");
    EXPECT_EQ(value_of(said, "0008,0060"), "XA");
    EXPECT_EQ(value_of(said, "0010,0010"), "Simulated^renal");
    EXPECT_EQ(value_of(said, "0008,0008"), "DERIVED\\SECONDARY\\SINGLE PLANE\\SIMULATED");
    EXPECT_EQ(value_of(said, "0008,103e"), "SIMULATED live, from frame 0");
    EXPECT_EQ(value_of(said, "0008,2111"), "simulated, no patient was imaged");
    EXPECT_EQ(value_of(said, "0018,0015"), "PHANTOM");
    EXPECT_EQ(value_of(said, "0028,0300"), "YES");
    EXPECT_EQ(value_of(said, "0028,0008"), "5");
    EXPECT_EQ(value_of(said, "0028,0010"), "48");
    EXPECT_EQ(value_of(said, "0028,0100"), "8");
    EXPECT_EQ(value_of(said, "0028,1040"), "DISP");
    EXPECT_EQ(value_of(said, "0018,0060"), "74");
    EXPECT_EQ(value_of(said, "0018,1155"), "SC");
    EXPECT_NEAR(std::stod(value_of(said, "0018,1510")), -30, 1e-6);
    EXPECT_NEAR(std::stod(value_of(said, "0018,1511")), 25, 1e-6);
    EXPECT_NEAR(std::stod(value_of(said, "0018,1110")), 1100, 1e-6);
    EXPECT_NEAR(std::stod(value_of(said, "0018,1111")), 750, 1e-6);
    EXPECT_NEAR(std::stod(value_of(said, "0018,1164")), 300.0 / 48, 1e-6);
    EXPECT_NEAR(std::stod(value_of(said, "0028,0030")), 300.0 / 48 * 750 / 1100, 1e-6);
    EXPECT_NEAR(std::stod(value_of(said, "0018,115e")), 10 * 5 * 0.0125, 1e-6);
    EXPECT_EQ(value_of(said, "0018,1065").substr(0, 10), "0\\66.66666");
    EXPECT_EQ(value_of(said, "0018,1049"), "320");
}

TEST_F(Angiograms, KeepSignalsInSixteenBitsWithTheirMask) {
    if (!has_tools()) GTEST_SKIP() << "dcmdump is not installed";
    Series series = series_of(16);
    series.pixels = Pixels::Signal;
    series.radiation = dicom::Radiation::Acquisition;
    series.first_is_mask = true;
    series.scale = 1000;
    Angiogram angiogram(series);
    std::vector<std::uint16_t> expected;
    for (int frame = 0; frame < 3; ++frame) {
        render::Field signal(16, 16);
        for (std::size_t i = 0; i < signal.values.size(); ++i)
            signal.values[i] = 0.25f * static_cast<float>(i);
        signal.values[1] = -3;
        signal.values[2] = std::numeric_limits<float>::quiet_NaN();
        signal.values[3] = std::numeric_limits<float>::infinity();
        angiogram.add(signal, technique, 0.5 * frame);
        for (std::size_t i = 0; i < signal.values.size(); ++i)
            expected.push_back(i == 1 || i == 2 ? 0
                               : i == 3         ? 65535
                                        : static_cast<std::uint16_t>(std::min<std::size_t>(250 * i, 65535)));
    }
    angiogram.write(folder / "a.dcm");
    const std::string pixels = pixels_of(folder, folder / "a.dcm");
    ASSERT_EQ(pixels.size(), 2 * expected.size());
    EXPECT_EQ(std::memcmp(pixels.data(), expected.data(), pixels.size()), 0);
    const std::string said = elements(folder, folder / "a.dcm");
    EXPECT_EQ(value_of(said, "0028,0101"), "16");
    EXPECT_EQ(value_of(said, "0028,1040"), "LIN");
    EXPECT_EQ(value_of(said, "0018,1155"), "GR");
    EXPECT_EQ(value_of(said, "0028,6101"), "AVG_SUB");
    EXPECT_EQ(value_of(said, "0028,1090"), "SUB");
}

TEST_F(Angiograms, AreEqualForEqualContentAndHaveNamesOfTheirOwnOtherwise) {
    const auto write = [&](const char* name, std::uint64_t study, int seed) {
        std::mt19937 random(static_cast<unsigned>(seed));
        Series series = series_of(20);
        series.study = study;
        Angiogram angiogram(series);
        angiogram.add(noise(20, random), technique, 0);
        angiogram.write(folder / name);
        return read(folder / name);
    };
    const std::string a = write("a.dcm", 1, 1);
    EXPECT_EQ(a, write("b.dcm", 1, 1));
    EXPECT_NE(a, write("c.dcm", 2, 1));
    EXPECT_NE(a, write("d.dcm", 1, 2));
    for (const auto& entry : fs::directory_iterator(folder.path()))
        EXPECT_TRUE(entry.path().extension() == ".dcm") << "left over: " << entry.path();
    if (!has_tools()) return;
    const auto uid = [&](const char* name) { return value_of(elements(folder, folder / name), "0008,0018"); };
    EXPECT_EQ(uid("a.dcm"), uid("b.dcm"));
    EXPECT_NE(uid("a.dcm"), uid("c.dcm"));
    EXPECT_NE(uid("a.dcm"), uid("d.dcm"));
    EXPECT_EQ(uid("a.dcm").substr(0, 5), "2.25.");
}

TEST_F(Angiograms, AnyStandAndAnyNameGiveAFileWithoutWarnings) {
    if (!has_tools()) GTEST_SKIP() << "dcmdump is not installed";
    const char* const names[] = {
        "",
        "Zoë Ångström",
        "a\\b^c=d",
        "tab\tand\nline",
        "a name of far more than sixty-four bytes, as a title of a scenario may well be, é"
        "éééééééééééééééééééééééééééééé",
        "  blanks  "};
    for (unsigned seed = 1; seed <= 60; ++seed) {
        std::mt19937 random(seed);
        const auto between = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        Series series = series_of(static_cast<int>(between(2, 40)));
        render::CArm& arm = series.arm;
        arm.lao = between(-120, 120) * geometry::degree;
        arm.cranial = between(-45, 45) * geometry::degree;
        arm.sod = between(300, 1500);
        arm.sid = arm.sod + between(1, 500);
        arm.detector_width = between(20, 600);
        if (seed % 2) arm.opening_width = between(1, 300), arm.opening_height = between(1, 300);
        arm.isocentre = geometry::Vec3(between(-1e4, 1e4), between(-1e4, 1e4), between(-1e4, 1e4));
        series.patient = names[seed % 6];
        series.subject = names[(seed / 6) % 6];
        series.description = names[(seed / 3) % 6];
        series.derivation = seed % 5 == 0 ? names[(seed / 2) % 6] : "";
        series.frame_rate = seed % 3 == 0 ? 0 : between(0.01, 60);
        series.study = seed;
        Angiogram angiogram(series);
        const int frames = static_cast<int>(between(1, 60));
        double time = between(0, 1e4);
        for (int frame = 0; frame < frames; ++frame) {
            const render::Technique any{between(40, 125), between(0, 1000), between(0, 100),
                                        between(0, 1e3),  between(0, 1e3),  1};
            angiogram.add(noise(arm.pixels, random), any, time += between(1e-3, 10));
        }
        angiogram.write(folder / "a.dcm");
        const std::string all = elements(folder, folder / "a.dcm");
        EXPECT_EQ(value_of(all, "0028,0008"), std::to_string(frames)) << "seed " << seed;
        EXPECT_NE(printed(folder, fmt::format("dcm2pnm --quiet --frame {} {} {}", frames,
                                              (folder / "a.dcm").string(), (folder / "a.pnm").string()))
                      .find("status 0"),
                  std::string::npos)
            << "seed " << seed;
    }
}

TEST_F(Angiograms, OrientThePatient) {
    render::CArm arm;
    EXPECT_EQ(dicom::patient_orientation(arm), "L\\F");
    arm.lao =
        90 * geometry::degree;  // the detector on the left side: the front of the body to the viewer's left
    EXPECT_EQ(dicom::patient_orientation(arm), "P\\F");
    arm.lao = -90 * geometry::degree;
    EXPECT_EQ(dicom::patient_orientation(arm), "A\\F");
    arm.lao = 30 * geometry::degree;
    EXPECT_EQ(dicom::patient_orientation(arm), "LP\\F");
}

TEST_F(Angiograms, RefuseWhatTheyCannotKeep) {
    Series wrong = series_of(16);
    wrong.arm.sid = 0;
    EXPECT_NE(refusal([&] { Angiogram angiogram(wrong); }), "");
    Angiogram angiogram(series_of(16));
    EXPECT_THROW(angiogram.write(folder / "a.dcm"), std::logic_error);
    EXPECT_THROW(angiogram.add(render::GrayImage{8, 8, std::vector<std::uint8_t>(64)}, technique, 0),
                 std::invalid_argument);
    EXPECT_THROW(angiogram.add(render::Field(16, 16), technique, 0), std::invalid_argument);
    EXPECT_EQ(angiogram.frames(), 0);
    angiogram.add(render::GrayImage{16, 16, std::vector<std::uint8_t>(256)}, technique, 0);
    test::expect_refusal([&] { angiogram.write("/proc/nope/a.dcm"); },
                         "/proc/nope/a.dcm: cannot be written: No such file or directory");
    fs::create_symlink("/dev/full", folder / "full.dcm");
    test::expect_refusal([&] { angiogram.write(folder / "full.dcm"); },
                         "full.dcm: cannot be written: No space left on device");
}

}  // namespace test
