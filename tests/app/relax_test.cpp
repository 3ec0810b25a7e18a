/// `seldinger relax` as a user meets it: what it leaves behind, and every refusal with nothing half-written.

#include <nlohmann/json.hpp>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/io/csv.h"
#include "tests/anatomies.h"
#include "tests/app/program.h"

namespace app {
namespace {

using test::asset, test::Outcome, test::read, test::run, test::TemporaryFolder, test::write;
using Words = std::vector<std::string>;

/// A quarter of a circle of 20 mm with 10 mm straight before and after, a point every degree or millimetre.
std::string bent_tube() {
    std::vector<geometry::Vec3> points;
    for (int i = 0; i < 10; ++i) points.emplace_back(i, 0, 0);
    for (int i = 0; i <= 90; ++i) {
        const double a = i * M_PI / 180;
        points.emplace_back(10 + 20 * std::sin(a), 20 - 20 * std::cos(a), 0);
    }
    for (int i = 1; i <= 10; ++i) points.emplace_back(30, 20 + i, 0);
    return io::points_csv(points);
}

/// The bent tube, a wire of 40 segments and further flags; flags given again take the later value.
class Bench : public testing::Test {
public:
    Bench() { write(folder / "tube.csv", bent_tube()); }
    Outcome relax(const Words& words) const {
        return run(folder,
                   test::joined({"relax", "--out", folder / "joints.csv", "--report", folder / "report.json"},
                                words));
    }
    Words good(const Words& instead = {}) const {
        std::vector<std::pair<std::string, std::string>> flags = {
            {"--tube", folder / "tube.csv"}, {"--radius", "1"},    {"--segments", "40"},
            {"--segment-length", "1"},       {"--rigidity", "50"}, {"--wall-stiffness", "42"},
            {"--method", "segment:2"},       {"--cycles", "5"}};
        for (std::size_t i = 0; i + 1 < instead.size(); i += 2) {
            std::erase_if(flags, [&](const auto& flag) { return flag.first == instead[i]; });
            if (instead[i + 1] != "-") flags.emplace_back(instead[i], instead[i + 1]);
        }
        Words words;
        for (const auto& [flag, value] : flags) words.insert(words.end(), {flag, value});
        return words;
    }
    void expect_refused(const Words& instead, const std::string& expected) const {
        const Outcome result = relax(good(instead));
        test::expect_refused(result, expected);
        EXPECT_LE(std::count(result.error.begin(), result.error.end(), '\n'), 2) << result.error;
        for (const char* file : {"joints.csv", "report.json", "push.csv", "joints.csv.part"})
            EXPECT_FALSE(std::filesystem::exists(folder / file)) << file;
    }
    void expect_tube_refused(const std::string& csv, const std::string& expected) const {
        write(folder / "tube.csv", csv);
        expect_refused({}, expected);
    }
    void expect_wire_refused(const std::string& csv, const std::string& expected) const {
        write(folder / "wire.csv", csv);
        expect_refused({"--wire", folder / "wire.csv", "--segments", "-", "--segment-length", "-"}, expected);
    }
    TemporaryFolder folder;
};

const std::string header = "x_mm,y_mm,z_mm\n";

using Relax = Bench;
using RelaxRefuses = Bench;

}  // namespace

TEST_F(Relax, AnUnevenWallIsReportedAndItsTermsGiveTheSameWireAgain) {
    ASSERT_EQ(relax(good()).code, 0);
    const auto even = nlohmann::json::parse(read(folder / "report.json"));
    EXPECT_TRUE(even["wall_variation"].is_null());
    const Words method = {"--method", "segment:2:printed", "--wall-stiffness", "2"};
    Words words = test::joined(method, {"--wall-variation", "5"});
    const Outcome drawn = relax(good(words));
    ASSERT_EQ(drawn.code, 0) << drawn.error;
    test::expect_said(drawn.out, "segment:2:printed");
    const std::string joints = read(folder / "joints.csv");
    const auto report = nlohmann::json::parse(read(folder / "report.json"));
    std::string terms = "amplitude_share,phase_deg\n";
    for (const auto& term : report["wall_variation"]["terms"])
        terms += term["amplitude_share"].dump() + "," + term["phase_deg"].dump() + "\n";
    write(folder / "terms.csv", terms);
    words.back() = folder / "terms.csv";
    ASSERT_EQ(relax(good(words)).code, 0);
    const geometry::Polyline again = io::load_points(folder / "joints.csv");
    write(folder / "first.csv", joints);
    const geometry::Polyline first = io::load_points(folder / "first.csv");
    for (std::size_t i = 0; i < first.size(); ++i) EXPECT_LT((first[i] - again[i]).norm(), 1e-9) << i;
    ASSERT_EQ(relax(good(method)).code, 0);
    EXPECT_NE(read(folder / "joints.csv"), joints);
}

TEST_F(Relax, LeavesJointsAndAReport) {
    const Outcome result = relax(good());
    ASSERT_EQ(result.code, 0) << result.error;
    const geometry::Polyline joints = io::load_points(folder / "joints.csv");
    ASSERT_EQ(joints.size(), 41u);
    for (std::size_t i = 1; i < joints.size(); ++i) EXPECT_NEAR((joints[i] - joints[i - 1]).norm(), 1, 1e-9);
    const auto report = nlohmann::json::parse(read(folder / "report.json"));
    EXPECT_EQ(report["method"], "segment:2");
    EXPECT_EQ(report["segments"], 40);
    EXPECT_EQ(report["cycles"], 5);
    EXPECT_EQ(report["updates"], 5 * 820);
    EXPECT_GT(report["wall_queries"], 0);
    EXPECT_EQ(report["clamp"], "half");
    EXPECT_EQ(report["load_N_per_mm"], nlohmann::json({0.0, 0.0, 0.0}));
    EXPECT_GT(report["energy"]["bending_N_mm"], 0.5);
    EXPECT_EQ(report["energy"]["load_N_mm"], 0.0);
    EXPECT_NEAR(report["energy"]["total_N_mm"].get<double>(),
                report["energy"]["bending_N_mm"].get<double>() + report["energy"]["wall_N_mm"].get<double>(),
                1e-12);
    for (const char* key : {"gradient", "contacts", "max_penetration_mm", "cpu_s", "converged",
                            "strict_minimum", "push_force_N", "base_torque_N_mm"})
        EXPECT_TRUE(report.contains(key)) << key;
    EXPECT_FALSE(std::filesystem::exists(folder / "push.csv"));
}

TEST_F(Relax, TheSameCaseTwiceGivesTheSameBytes) {
    ASSERT_EQ(relax(good()).code, 0);
    const std::string first = read(folder / "joints.csv");
    ASSERT_EQ(relax(good()).code, 0);
    EXPECT_EQ(first, read(folder / "joints.csv"));
}

TEST_F(Relax, StopsAtTheTolerance) {
    ASSERT_EQ(relax(good({"--cycles", "300", "--tolerance", "1e-3"})).code, 0);
    const auto report = nlohmann::json::parse(read(folder / "report.json"));
    EXPECT_LE(report["gradient"], 1e-3);
    EXPECT_TRUE(report["converged"]);
    EXPECT_LT(report["cycles"], 300);
}

TEST_F(Relax, PushingLeavesARowAPush) {
    ASSERT_EQ(relax(good({"--push-from", "30"})).code, 0);
    const std::string rows = read(folder / "push.csv");
    EXPECT_EQ(rows.find("segments,iterations,cpu_us,energy_N_mm,gradient,max_penetration_mm\n31,"), 0u)
        << rows;
    EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 11);
    test::expect_said(rows, "\n40,");
    EXPECT_EQ(io::load_points(folder / "joints.csv").size(), 41u);
}

TEST_F(Relax, AWireLeftBehindCanBeTakenUpAgain) {
    ASSERT_EQ(relax(good()).code, 0);
    std::filesystem::rename(folder / "joints.csv", folder / "wire.csv");
    const Outcome result = relax(good({"--wire", folder / "wire.csv", "--segments", "-", "--segment-length",
                                       "-", "--entry-direction", "1,0,0", "--method", "first-order"}));
    EXPECT_EQ(result.code, 0) << result.error;
}

TEST_F(Relax, EveryMethodLowersTheEnergyAndIsNamedInTheReport) {
    ASSERT_EQ(relax(good({"--cycles", "1", "--method", "segment:1"})).code, 0);
    const auto report = [&] { return nlohmann::json::parse(read(folder / "report.json")); };
    const double start = report()["energy"]["total_N_mm"];
    for (const char* method : {"global", "first-order", "konings", "combined:1", "combined:2:7",
                               "segment:3:no-a:uniform:plain", "segment:2:fast"}) {
        const Outcome result = relax(good({"--cycles", "20", "--method", method}));
        EXPECT_EQ(result.code, 0) << result.error;
        EXPECT_EQ(report()["method"], method);
        EXPECT_LT(report()["energy"]["total_N_mm"], start) << method;
    }
    const Outcome help = run(folder, {"relax", "--help"});
    for (const char* word : {"segment:M[:delta]", ":fast", ":no-r", "konings", "geometric", "combined:M"})
        EXPECT_NE(help.out.find(word), std::string::npos) << word;
}

TEST_F(Relax, AClampOfThePaperIsSofterAndALoadBendsTheWire) {
    write(folder / "tube.csv", io::points_csv(geometry::Polyline{{0, 0, 0}, {50, 0, 0}}));
    // 40 mm of wire in the middle of a wide tube sag by q L⁴/8EI = 0.064 mm, by 1/N² more with half cells and
    // by 10/3N more by the paper's rule.
    const auto sag = [&](const std::string& clamp) {
        const Outcome result =
            relax(good({"--radius", "20", "--method", "global", "--load", "0,0,-1e-5", "--clamp", clamp}));
        EXPECT_EQ(result.code, 0) << result.error;
        return -io::load_points(folder / "joints.csv").back().z() / 0.064;
    };
    EXPECT_NEAR(sag("half"), 1 + 1 / 1600.0, 1e-5);
    EXPECT_NEAR(sag("paper"), 1 + 10 / 120.0, 2e-3);
    const auto report = nlohmann::json::parse(read(folder / "report.json"));
    EXPECT_EQ(report["clamp"], "paper");
    EXPECT_EQ(report["load_N_per_mm"], nlohmann::json({0.0, 0.0, -1e-5}));
    EXPECT_LT(report["energy"]["load_N_mm"], 0);
}

TEST_F(Relax, AnAnatomyIsEnteredByABranch) {
    const auto anatomy = anatomy::write_anatomy(test::iliac_renal(), folder.path(), {});
    const Outcome result = relax(good(
        {"--tube", "-", "--radius", "-", "--anatomy", anatomy, "--branch", "RIIA", "--segment-length", "2"}));
    EXPECT_EQ(result.code, 0) << result.error;
}

TEST_F(RelaxRefuses, TubesThatAreNone) {
    expect_tube_refused(header + "0,0,0\n", "tube.csv:2:1: 1 point was found");
    expect_tube_refused(header, "tube.csv:1:1: 0 point");
    expect_tube_refused(header + "0,0,0\n9,0,0\n9,0,0\n50,0,0\n", "tube.csv:4:1: the point repeats");
    expect_tube_refused(header + "0,0,0\n9,nan,0\n",
                        "tube.csv:3:3: 'nan' was found; expected a finite number");
    expect_tube_refused(header + "0,0,0\n9,0\n", "tube.csv:3:4: the row ends after 2 numbers");
    expect_tube_refused("x,y,z\n0,0,0\n9,0,0\n",
                        "tube.csv:1:1: 'x,y,z' was found; expected the header 'x_mm,");
    expect_tube_refused("", "tube.csv:1:1: '' was found; expected the header");
    expect_refused({"--tube", folder / "no.csv"}, "no.csv: no such file can be read");
}

TEST_F(RelaxRefuses, ARadiusThatDoesNotTakeTheWire) {
    expect_refused({"--wire-diameter", "2"}, "--radius: a tube of radius 1 mm does not take");
    expect_refused({"--radius", "0"}, "--radius: '0' was found");
    expect_refused({"--radius", "-"}, "--radius: it is missing");
}

TEST_F(RelaxRefuses, NumbersThatNoWireHas) {
    for (const char* flag : {"--rigidity", "--wall-stiffness"}) {
        for (const char* value : {"0", "-1", "1e12"})
            expect_refused({flag, value}, std::string(flag) + ": '");
        expect_refused({flag, "nan"}, std::string(flag) + ": expected a number, found 'nan'");
    }
    expect_refused({"--segments", "1"}, "--segments: '1' was found; expected 2 to 20000 segments");
    expect_refused({"--entry-direction", "0,0,0"}, "--entry-direction: '0,0,0' was found");
    expect_refused({"--clamp", "hinge"}, "--clamp: 'hinge' was found; expected half or paper");
    for (const char* load : {"1,2", "0,0,nan", "0,0,x", "-60,-60,-60", "inf,0,0"})
        expect_refused({"--load", load},
                       std::string("--load: '") + load +
                           "' was found; expected three numbers X,Y,Z of a force up to 100 N/mm");
    expect_refused({"--cycles", "0"}, "--cycles: '0'");
    expect_refused({"--tolerance", "-1"}, "--tolerance: '-1'");
    expect_refused({"--push-from", "40"}, "--push-from: '40' was found; expected 2 to 39 segments");
}

TEST_F(RelaxRefuses, WiresThatDoNotStartInside) {
    expect_refused({"--segments", "60"}, "60 segments of 1 mm leave the end of");
    expect_wire_refused(header + "0,0,0\n2,0,0\n4,0,0\n5.2,1.6,0\n",
                        "wire.csv: joint 3 starts 0.6 mm outside the lumen of");
}

TEST_F(RelaxRefuses, WiresOfUnequalSegments) {
    expect_wire_refused(header + "0,0,0\n2,0,0\n4,0,0\n6.5,0,0\n8.5,0,0\n",
                        "wire.csv:5:1: joints 2 and 3 are 2.5 mm apart, others 2 mm");
    expect_wire_refused(header + "0,0,0\n2,0,0\n", "2 joints were found; expected 3 or more");
    expect_refused({"--wire", folder / "wire.csv"}, "--wire: the file gives the segments");
}

TEST_F(RelaxRefuses, UnknownMethodsWithThoseThatExist) {
    expect_refused({"--method", "newton"},
                   "'newton' is not known; methods are: global, first-order, konings, geom");
    expect_refused({"--method", "segment:6"}, "'segment:6' names no possible number");
    expect_refused({"--method", "segment:2:x"}, "'segment:2:x' has no 'x'");
    expect_refused({"--method", "segment:2:1"}, "'segment:2:1' names no possible separation");
    expect_refused({"--method", "combined:2:fast"}, "'combined:2:fast' has no 'fast'");
}

TEST_F(RelaxRefuses, AnatomiesThatAreOpenOrUnknown) {
    const Words anatomy = {"--tube", "-", "--radius", "-", "--anatomy", folder / "iliac-renal.anatomy.json"};
    expect_refused(anatomy, "iliac-renal.anatomy.json: no such anatomy");
    expect_refused({"--anatomy", anatomy.back()}, "both were given");
    anatomy::write_anatomy(test::iliac_renal(), folder.path(), {});
    expect_refused(test::joined(anatomy, {"--branch", "LCX"}), "--branch: 'LCX' is no branch of");
    std::string stl = read(folder / "iliac-renal.stl");
    stl.replace(84 + 50 * 30'000, 50, stl.substr(84, 50));  // one triangle gone, another twice
    write(folder / "iliac-renal.stl", stl);
    expect_refused(anatomy, "the mesh is open at");
}

TEST_F(RelaxRefuses, FilesThatCannotBeWritten) {
    Words words = good();
    words.insert(words.begin(),
                 {"relax", "--out", folder / "no/joints.csv", "--report", folder / "report.json"});
    Outcome result = run(folder, words);
    test::expect_refused(result, "no/joints.csv: cannot be written: there is no folder");
    words[2] = folder / "tube.csv";
    result = run(folder, words);
    test::expect_refused(result, "would overwrite what is read");
    EXPECT_EQ(read(folder / "tube.csv"), bent_tube());
    words[2] = folder / "report.json";
    test::expect_said(run(folder, words).error, "would be written twice");
}

}  // namespace app
