#include "engine/anatomy/import/given_centrelines.h"

#include "tests/engine/anatomy/mesh_texts.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::Vec3;
using test::expect_said, test::TemporaryFolder, test::write;

/// Two lines of three points, with radii and VMTK's numbers of groups.
PolyData two_lines() {
    PolyData data;
    PolyData::Array radius{"MaximumInscribedSphereRadius", {}, {}}, group{"GroupIds", {4, 7}, {}};
    for (int i = 0; i < 6; ++i) {
        data.points.emplace_back(i, 0, i < 3 ? 0 : 5);
        radius.numbers.push_back(0.1 * (1 + i));
    }
    data.lines = {{{0, 1, 2}, 0}, {{3, 4, 5}, 1}};
    data.cells = 2;
    data.of_points = {radius};
    data.of_cells = {group};
    return data;
}

std::string sv_path(const std::string& points) {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\" ?>\n<format version=\"1.0\" />\n<path id=\"1\" "
           "method=\"0\">\n"
           "<timestep id=\"0\"><path_element><control_points><point id=\"0\" x=\"0\" y=\"0\" z=\"0\" />"
           "<point id=\"1\" x=\"9\" y=\"0\" z=\"0\" /></control_points>" +
           points + "</path_element></timestep></path>\n";
}

}  // namespace

using GivenCentrelines = test::InFolder;

TEST_F(GivenCentrelines, PolyDataBringsNamesAndRadii) {
    PolyData data = two_lines();
    write(folder / "a.VTP", test::VtpText({"appended", true, true}).of(data));
    std::vector<GivenLine> lines = load_centrelines(folder / "a.VTP", 10).lines;
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0].name, "group4");
    EXPECT_EQ(lines[1].name, "group7");
    EXPECT_EQ(lines[1].points[2], Vec3(50, 0, 50));
    ASSERT_EQ(lines[1].radii.size(), 3u);
    EXPECT_NEAR(lines[1].radii[2], 6, 1e-12);
    data.of_cells = {{"Names", {}, {"LCCA", "LICA"}}};
    write(folder / "b.vtk", test::legacy_vtk(data, true, false));
    lines = load_centrelines(folder / "b.vtk", 1).lines;
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0].name + lines[1].name, "LCCALICA");
    data.lines.clear();
    write(folder / "c.vtp", test::VtpText({}).of(data));
    test::expect_refusal([&] { load_centrelines(folder / "c.vtp", 1); }, "no line of two points or more");
}

TEST_F(GivenCentrelines, SimVascularPathIsNamedAsItsFile) {
    write(folder / "aorta.pth", sv_path("<path_points><path_point id=\"0\"><pos x=\"1\" y=\"2\" z=\"3\" "
                                        "/><tangent x=\"0\" y=\"0\" z=\"1\" />"
                                        "</path_point><path_point id=\"1\"><pos x=\"1.5\" y=\"-2e0\" z=\"3\" "
                                        "/></path_point></path_points>"));
    const std::vector<GivenLine> lines = load_centrelines(folder / "aorta.pth", 10).lines;
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].name, "aorta");
    ASSERT_EQ(lines[0].points.size(), 2u);
    EXPECT_EQ(lines[0].points[1], Vec3(15, -20, 30));
    EXPECT_TRUE(lines[0].radii.empty());
    write(folder / "control.pth", sv_path(""));
    EXPECT_EQ(load_centrelines(folder / "control.pth", 1).lines[0].points[1], Vec3(9, 0, 0));
    write(folder / "bad.pth",
          sv_path("<path_points><path_point><pos x=\"1\" y=\"two\" z=\"3\"/></path_point></path_points>"));
    test::expect_refusal([&] { load_centrelines(folder / "bad.pth", 1); },
                         "bad.pth: point 0: y = 'two' was found");
    write(folder / "none.pth", "<path/>");
    test::expect_refusal([&] { load_centrelines(folder / "none.pth", 1); },
                         "there is no <path> with a <timestep>");
}

TEST_F(GivenCentrelines, NamesOfJsonAndCsvAreKept) {
    write(folder / "a.json", "{\"LCCA\":[[0,0,0,1],[1,2,0,1.5]],\"LICA\":[[1,2,0],[3,2,0]]}");
    const std::vector<GivenLine> json = load_centrelines(folder / "a.json", 10).lines;
    ASSERT_EQ(json.size(), 2u);
    EXPECT_EQ(json[0].name, "LCCA");
    EXPECT_EQ(json[0].radii, (std::vector<double>{10, 15}));
    EXPECT_EQ(json[1].name, "LICA");
    write(folder / "a.csv", "branch,x_mm,y_mm,z_mm,r_mm\nb,0,0,0,2\nb,1,0,0,3\n");
    const std::vector<GivenLine> csv = load_centrelines(folder / "a.csv", 10).lines;
    EXPECT_EQ(csv[0].name, "b");
    EXPECT_EQ(csv[0].radii, (std::vector<double>{2, 3}));
}

}  // namespace anatomy
