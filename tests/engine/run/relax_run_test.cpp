#include "engine/run/relax_run.h"

#include <nlohmann/json.hpp>

#include "engine/anatomy/scenes.h"
#include "engine/io/csv.h"
#include "physics/wire/energy.h"
#include "tests/engine/fixtures.h"

namespace run {
namespace {

/// 40 segments in the first bend of the winding tube.
struct Given {
    test::TemporaryFolder folder;
    RelaxRequest request;
    Given() {
        test::write(folder / "tube.csv", io::points_csv(anatomy::draw(anatomy::find_scene("sinuous")->path)));
        request.tube = folder / "tube.csv";
        request.radius = 1;
        request.segments = 40;
        request.segment_length = 1;
        request.rigidity = 50;
        request.wall_stiffness = 42;
        request.method = "segment:2";
        request.cycles = 20;
    }
};

}  // namespace

TEST(RelaxCase, StartsOnTheCentrelineAlongItsFirstChord) {
    const Given given;
    const RelaxCase c = make_relax_case(given.request);
    EXPECT_EQ(c.wire.segments(), 40);
    EXPECT_TRUE(physics::validate(c.wire).empty());
    EXPECT_LT((c.wire.joints[10] - geometry::Vec3(10, 0, 0)).norm(), 1e-9);
    EXPECT_LT((c.wire.tangents[0] - geometry::Vec3::UnitX()).norm(), 1e-12);
    const auto contacts = physics::all_contacts(c.wire, *c.wall);
    EXPECT_EQ(physics::largest_penetration(contacts), 0);
}

TEST(RelaxCase, TheWallMayBeStifferInPlacesByASeedOrAFileOfTerms) {
    Given given;
    EXPECT_TRUE(make_relax_case(given.request).stiffness.uniform());
    const double whole = geometry::length_of(anatomy::draw(anatomy::find_scene("sinuous")->path));
    given.request.wall_variation = "7";
    const physics::WallStiffness drawn = make_relax_case(given.request).stiffness;
    ASSERT_EQ(drawn.terms().size(), 9u);
    EXPECT_NEAR(drawn.length(), whole, 1e-9);
    EXPECT_EQ(drawn.terms()[0].amplitude, 42 * physics::drawn_variation(7).terms[0].amplitude);

    const std::filesystem::path file = given.folder / "terms.csv";
    given.request.wall_variation = file.string();
    test::write(file, "amplitude_share,phase_deg\n0.5,0\n-0.25,90\n");
    given.request.wall_variation_length = 30;
    const RelaxCase c = make_relax_case(given.request);
    EXPECT_NEAR(c.stiffness.at(30), 42 - 21, 1e-9);
    physics::WallContact contact;
    const geometry::Vec3 x(10, 0.9, 0);
    c.wall->contacts({&x, 1}, {&contact, 1});
    EXPECT_NEAR(contact.stiffness, c.stiffness.at(10), 1e-9);
    const nlohmann::json report =
        nlohmann::json::parse(report_json(run_relax(make_relax_case(given.request))));
    EXPECT_EQ(report["wall_variation"]["length_mm"], 30);
    EXPECT_EQ(report["wall_variation"]["terms"][1]["amplitude_share"], -0.25);
    EXPECT_NEAR(report["wall_variation"]["terms"][1]["phase_deg"].get<double>(), 90, 1e-12);

    const auto refused = [&](const std::string& text, const std::string& part) {
        test::write(file, text);
        const std::string message = test::refusal([&] { make_relax_case(given.request); });
        EXPECT_NE(message.find(part), std::string::npos) << text << ": " << message;
    };
    const std::string header = "amplitude_share,phase_deg\n";
    refused("share,phase\n0.5,0\n", "terms.csv:1:1: 'share,phase' was found; expected the header");
    refused(header, "terms.csv:2:1");
    refused(header + "0.5\n", "terms.csv:2:4");
    refused(header + "0.5,x\n", "terms.csv:2:5");
    refused(header + "0.5,0\n-0.4,0\n0.1,0\n", "terms.csv:4:1: the shares add up to 1 here");
    for (const char* word : {"", "-3", "nothing.csv", "99999999999999999999999"}) {
        given.request.wall_variation = word;
        EXPECT_NE(test::refusal([&] { make_relax_case(given.request); }).find("seed"), std::string::npos)
            << word;
    }
    given.request.wall_variation.reset();
    test::expect_refusal([&] { make_relax_case(given.request); }, "--wall-variation-length");
}

TEST(RelaxCase, TheEntryDirectionIsMadeUnit) {
    Given given;
    given.request.entry_direction = "3,0,4";
    EXPECT_LT((make_relax_case(given.request).wire.tangents[0] - geometry::Vec3(0.6, 0, 0.8)).norm(), 1e-15);
    for (const char* wrong : {"1,2", "1,2,3,4", "a,b,c", "0,0,0", "nan,0,1", ""}) {
        given.request.entry_direction = wrong;
        EXPECT_NE(test::refusal([&] { make_relax_case(given.request); }).find("--entry-direction"),
                  std::string::npos)
            << wrong;
    }
}

TEST(RelaxCase, TheWireHasTheClampAndTheLoadThatWereAskedForHoweverItIsGiven) {
    Given given;
    EXPECT_EQ(make_relax_case(given.request).wire.grid.end_cells, physics::EndCells::Half);
    EXPECT_EQ(make_relax_case(given.request).wire.load, geometry::Vec3::Zero());
    given.request.clamp = "paper";
    given.request.load = "-1e-3,0,2.5e-5";
    const auto expect_both = [&] {
        const RelaxCase c = make_relax_case(given.request);
        EXPECT_EQ(c.wire.grid.end_cells, physics::EndCells::Paper);
        EXPECT_EQ(c.wire.load, geometry::Vec3(-1e-3, 0, 2.5e-5));
    };
    expect_both();
    given.request.push_from = 30;
    expect_both();
    test::write(given.folder / "wire.csv", io::points_csv(make_relax_case(given.request).wire.joints));
    given.request.wire = given.folder / "wire.csv";
    given.request.segments.reset();
    given.request.segment_length.reset();
    given.request.push_from.reset();
    expect_both();
    given.request.clamp = "Half";
    EXPECT_EQ(test::refusal([&] { make_relax_case(given.request); }),
              "--clamp: 'Half' was found; expected half or paper");
}

TEST(RelaxCase, TheWiresRadiusIsTakenOffTheLumens) {
    Given given;
    given.request.wire_diameter = 0.5;
    const RelaxCase c = make_relax_case(given.request);
    EXPECT_DOUBLE_EQ(physics::all_contacts(c.wire, *c.wall)[5].clearance, 0.75);
}

TEST(RelaxRun, ReportsWhatTheEnergyFunctionsSay) {
    const Given given;
    const RelaxOutcome outcome = run_relax(make_relax_case(given.request));
    const RelaxCase fresh = make_relax_case(given.request);
    const auto contacts = physics::all_contacts(outcome.wire, *fresh.wall);
    EXPECT_DOUBLE_EQ(outcome.energy.total(), physics::total_energy(outcome.wire, contacts).total());
    EXPECT_DOUBLE_EQ(outcome.gradient, physics::relative_gradient(outcome.wire, contacts));
    EXPECT_EQ(outcome.converged, outcome.gradient <= usual_tolerance);
    EXPECT_LE(outcome.iterations, 20);
    EXPECT_LE(outcome.updates, outcome.iterations * 820);
    EXPECT_GT(outcome.cpu, 0);
    const auto json = nlohmann::json::parse(report_json(outcome));
    EXPECT_EQ(json["energy"]["total_N_mm"].get<double>(), outcome.energy.total());
    EXPECT_TRUE(json["strict_minimum"].is_null());
}

TEST(RelaxRun, PushingEndsNearTheWireThatStartedWhole) {
    Given given;
    given.request.cycles = 300;
    given.request.tolerance = 1e-8;
    const RelaxOutcome whole = run_relax(make_relax_case(given.request));
    given.request.push_from = 35;
    double last = 0;
    const RelaxOutcome pushed = run_relax(make_relax_case(given.request), [&](const RelaxProgress& p) {
        EXPECT_GE(p.part, last);
        last = p.part;
    });
    ASSERT_EQ(pushed.pushes.size(), 5u);
    EXPECT_EQ(pushed.pushes.front().segments, 36);
    EXPECT_EQ(pushed.pushes.back().segments, 40);
    EXPECT_EQ(pushed.pushes.back().energy, pushed.energy.total());
    EXPECT_NEAR(pushed.energy.total(), whole.energy.total(), 1e-6);
}

TEST(RelaxRun, FilesAreAllThereOrNone) {
    const Given given;
    const RelaxOutcome outcome = run_relax(make_relax_case(given.request));
    const RelaxFiles files{given.folder / "j.csv", given.folder / "no/r.json"};
    EXPECT_NE(test::refusal([&] { write_files(files, outcome); }), "");
    EXPECT_FALSE(std::filesystem::exists(files.joints));
    test::expect_refusal([&] { check_files(files, given.request); }, "there is no folder");
}

}  // namespace run
