/// Segmentations of DICOM, as other programs write them, whole and damaged.

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <random>

#include "engine/anatomy/import/mask_import.h"
#include "engine/io/wall.h"
#include "engine/patient/ct_image.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/patient/dicom_writer.h"
#include "tests/engine/patient/seg_writer.h"

namespace patient {
namespace {

using geometry::Vec3;

/// Oblique, in steps of three lengths; no multiple of 8 samples in a slice.
render::VolumeGrid oblique(int slices = 9) {
    const geometry::Mat3 turn =
        (Eigen::AngleAxisd(0.3, Vec3::UnitX()) * Eigen::AngleAxisd(-0.2, Vec3::UnitZ())).toRotationMatrix();
    render::VolumeGrid grid;
    grid.size = {7, 5, slices};
    grid.origin = Vec3(-20.5, 31.25, 1200.125);
    grid.steps = {0.75 * turn.col(0), 0.5 * turn.col(1), 1.25 * turn.col(2)};
    return grid;
}

/// Marked in slices `from` to `to`, by chance.
test::Segment some(const render::VolumeGrid& grid, int number, const std::string& label, int from, int to,
                   unsigned seed) {
    std::mt19937 random(seed);
    test::Segment segment{number, label, std::vector<std::uint8_t>(grid.count(), 0)};
    for (int k = from; k <= to; ++k)
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i)
                segment.marked[grid.index(i, j, k)] = random() % 3 == 0 || (i == 2 && j == 2);
    return segment;
}

/// Holds what was read against what was written, at the places in space.
void expect_marked(const LabelImage& read, const render::VolumeGrid& grid,
                   const std::vector<test::Segment>& segments, double within = 1e-3) {
    const geometry::Mat3 inverse = read.grid.axes().inverse();
    std::size_t marked = 0, written = 0;
    for (const std::int16_t value : read.values) marked += value != 0;
    for (const test::Segment& segment : segments) {
        const auto name = std::ranges::find(read.names, segment.number, &LabelImage::Name::value);
        ASSERT_NE(name, read.names.end());
        EXPECT_EQ(name->name, segment.label);
        for (int k = 0; k < grid.size[2]; ++k)
            for (int j = 0; j < grid.size[1]; ++j)
                for (int i = 0; i < grid.size[0]; ++i) {
                    const bool is = segment.marked[grid.index(i, j, k)] > 0;
                    written += is;
                    const Vec3 at = inverse * (grid.at(i, j, k) - read.grid.origin);
                    const Vec3 near = at.array().round();
                    const bool within_grid = near.minCoeff() >= 0 && near.x() < read.grid.size[0] &&
                                             near.y() < read.grid.size[1] && near.z() < read.grid.size[2];
                    ASSERT_TRUE(within_grid || !is);
                    if (!within_grid) continue;
                    ASSERT_LT((at - near).norm(), within);
                    const std::size_t n = read.grid.index(
                        static_cast<int>(near.x()), static_cast<int>(near.y()), static_cast<int>(near.z()));
                    ASSERT_EQ(read.values[n * static_cast<std::size_t>(read.layers) +
                                          static_cast<std::size_t>(name->layer)] == segment.number,
                              is);
                }
    }
    EXPECT_EQ(marked, written);
}

using DicomSeg = test::InFolder;

constexpr E_TransferSyntax syntaxes[] = {EXS_LittleEndianExplicit, EXS_LittleEndianImplicit,
                                         EXS_BigEndianExplicit, EXS_DeflatedLittleEndianExplicit};

}  // namespace

TEST_F(DicomSeg, EachKindGivesBackPlacesAndSegments) {
    const render::VolumeGrid grid = oblique();
    const std::vector<test::Segment> apart = {some(grid, 1, "aorta", 1, 3, 1),
                                              some(grid, 4, "iliac", 4, 7, 2)},
                                     over = {some(grid, 1, "body", 1, 7, 1), some(grid, 2, "aorta", 2, 6, 2),
                                             some(grid, 7, "stent", 3, 4, 3)};
    std::size_t made = 0;
    for (const char* type : {"BINARY", "FRACTIONAL", "LABELMAP"})
        for (const bool all_slices : {false, true})
            for (const bool shuffled : {false, true})
                for (const bool rle : {false, true})
                    for (const bool overlap : {false, true}) {
                        test::SegFile how;
                        how.type = type;
                        const bool is_map = how.type == "LABELMAP", binary = how.type == "BINARY";
                        if ((is_map && overlap) || (binary && rle)) continue;
                        how.bits = binary ? 1 : is_map && shuffled ? 16 : 8;
                        how.all_slices = all_slices, how.shuffled = shuffled;
                        how.flipped = shuffled && all_slices;
                        how.syntax = rle ? EXS_RLELossless : syntaxes[made++ % std::size(syntaxes)];
                        if (is_map && rle) how.background = 9;
                        if (is_map) how.sop_class = "1.2.840.10008.5.1.4.1.1.66.7";
                        std::vector<test::Segment> segments = overlap ? over : apart;
                        if (how.type == "FRACTIONAL")
                            for (test::Segment& segment : segments)
                                for (std::uint8_t& value : segment.marked)
                                    value = static_cast<std::uint8_t>(255 * value);
                        SCOPED_TRACE(fmt::format("{} {} {} {} {}", type, all_slices, shuffled, rle, overlap));
                        test::write_seg(folder / "a.dcm", grid, segments, how);
                        const LabelImage read = read_labels(folder / "a.dcm");
                        expect_marked(read, grid, segments);
                        EXPECT_EQ(read.layers, overlap ? 3 : 1);
                        EXPECT_EQ(read.only_marked, !all_slices);
                        // Beyond slices that are left out, one empty slice is put.
                        EXPECT_EQ(read.grid.size[2], 9);
                        EXPECT_EQ(read.frame_of_reference, how.frame_of_reference);
                        EXPECT_TRUE(read.notes.empty());
                    }
}

TEST_F(DicomSeg, StepsComeFromThePositions) {
    const render::VolumeGrid grid = oblique(40);
    std::vector<test::Segment> segments = {some(grid, 1, "a", 3, 9, 1), some(grid, 2, "b", 12, 30, 2)};
    test::SegFile how;
    test::write_seg(folder / "gap.dcm", grid, segments, how);
    LabelImage read = read_labels(folder / "gap.dcm");
    expect_marked(read, grid, segments);
    EXPECT_EQ(read.grid.size[2], 30);
    // The header's spacing is another's, or there is none.
    how.spacing = 5;
    test::write_seg(folder / "lie.dcm", grid, segments, how);
    read = read_labels(folder / "lie.dcm");
    expect_marked(read, grid, segments);
    ASSERT_EQ(read.notes.size(), 1u);
    test::expect_said(read.notes[0], "slices lie 1.25 mm apart, and its header says 5");
    how.spacing = 0;
    test::write_seg(folder / "none.dcm", grid, segments, how);
    expect_marked(read_labels(folder / "none.dcm"), grid, segments);
    // Rounded as scanners do.
    how.rounded = 0.1;
    test::write_seg(folder / "rounded.dcm", grid, segments, how);
    read = read_labels(folder / "rounded.dcm");
    expect_marked(read, grid, segments, 0.15);
    // Slices 2 and 3 steps apart: the header says what a step is.
    segments = {some(grid, 1, "a", 3, 3, 1), some(grid, 2, "b", 5, 5, 2), some(grid, 3, "c", 8, 8, 3)};
    how = {};
    test::write_seg(folder / "sparse.dcm", grid, segments, how);
    read = read_labels(folder / "sparse.dcm");
    expect_marked(read, grid, segments);
    ASSERT_EQ(read.notes.size(), 1u);
    test::expect_said(read.notes[0],
                      "its slices lie at least 2.5 mm apart, and its header says 1.25; those between");
    how.spacing = 0;
    test::write_seg(folder / "unknown.dcm", grid, segments, how);
    test::expect_refusal([&] { read_labels(folder / "unknown.dcm"); },
                         "its slices lie 2.500 mm apart and more, in no equal steps");
    segments = {some(grid, 1, "a", 3, 3, 1)};
    how = {};
    how.shared_position = how.shared_segment = true;
    test::write_seg(folder / "one.dcm", grid, segments, how);
    expect_marked(read_labels(folder / "one.dcm"), grid, segments);
    how = {};
    how.moved.assign(40, 0);
    how.moved[5] = 0.4;
    segments = {some(grid, 1, "a", 3, 9, 1)};
    test::write_seg(folder / "moved.dcm", grid, segments, how);
    test::expect_refusal([&] { read_labels(folder / "moved.dcm"); }, "in no equal steps");
}

TEST_F(DicomSeg, FractionsFromHalfOnAreMarkedAndTold) {
    const render::VolumeGrid grid = oblique();
    test::Segment segment = some(grid, 1, "aorta", 1, 7, 1);
    for (std::size_t n = 0; n < segment.marked.size(); ++n)
        if (segment.marked[n] > 0) segment.marked[n] = static_cast<std::uint8_t>(1 + 37 * n % 255);
    test::SegFile how;
    how.type = "FRACTIONAL", how.bits = 8;
    test::write_seg(folder / "a.dcm", grid, {segment}, how);
    const LabelImage read = read_labels(folder / "a.dcm");
    for (std::uint8_t& value : segment.marked) value = value >= 128;
    expect_marked(read, grid, {segment});
    ASSERT_EQ(read.notes.size(), 1u);
    test::expect_said(read.notes[0], "voxels from half of 255 on are taken as marked");
}

TEST_F(DicomSeg, WhatIsNoSegmentationIsRefusedWithWhatWasFound) {
    const render::VolumeGrid grid = oblique();
    const std::vector<test::Segment> one = {some(grid, 1, "aorta", 1, 7, 1)};
    const auto said = [&](const test::SegFile& how, const std::vector<test::Segment>& segments) {
        test::write_seg(folder / "a.dcm", grid, segments, how);
        return test::refusal([&] { read_labels(folder / "a.dcm"); });
    };
    test::SegFile how;
    how.sop_class = UID_RTStructureSetStorage, how.modality = "RTSTRUCT";
    test::expect_said(said(how, one),
                      "a DICOM file of modality 'RTSTRUCT', 'RTStructureSetStorage', was found");
    test::expect_said(said(how, one), "3D Slicer makes one of contours");
    how.sop_class = UID_CTImageStorage, how.modality = "CT";
    test::expect_said(said(how, one), "a CT goes to --ct");
    how = {};
    how.type = "SURFACE";
    test::expect_said(said(how, one), "'SURFACE' was found for SegmentationType");
    how = {};
    how.bits = 16;
    test::expect_said(said(how, one), "16 bits in 1 values a sample were found");
    std::vector<test::Segment> twice = {one[0], one[0]};
    test::expect_said(said({}, twice), "frames 1 and 8 are of one slice of segment 1");
    twice[1].number = 0;
    test::expect_said(said({}, twice), "frame 8 has the segment 0; expected a number from 1");
    test::write(folder / "b.dcm", "");
    test::expect_refusal([&] { read_labels(folder / "b.dcm"); }, "b.dcm");
    test::write(folder / "b.dcm", "hello, this is no DICOM file");
    test::expect_refusal([&] { read_labels(folder / "b.dcm"); }, "b.dcm");
    how = {};
    test::write_seg(folder / "c.dcm", grid, one, how);
    const std::string whole = test::read(folder / "c.dcm");
    for (const std::size_t less : {4u, 20u, 300u}) {
        test::write(folder / "d.dcm", whole.substr(0, whole.size() - less));
        EXPECT_NE(test::refusal([&] { read_labels(folder / "d.dcm"); }), "") << less;
    }
}

TEST_F(DicomSeg, DamagedFilesAreReadOrRefused) {
    const io::WithoutWall here;
    const render::VolumeGrid grid = oblique();
    const std::vector<test::Segment> segments = {some(grid, 1, "aorta", 1, 5, 1),
                                                 some(grid, 2, "iliac", 3, 7, 2)};
    test::SegFile fractional;
    fractional.type = "FRACTIONAL", fractional.bits = 8, fractional.syntax = EXS_RLELossless;
    test::write_seg(folder / "a.dcm", grid, segments);
    test::write_seg(folder / "b.dcm", grid, segments, fractional);
    const unsigned seed = 64;
    std::mt19937 random(seed);
    int read = 0, refused = 0;
    for (const char* name : {"a.dcm", "b.dcm"}) {
        const std::string whole = test::read(folder / name);
        for (int t = 0; t < 1500; ++t) {
            std::string text = whole;
            for (unsigned n = random() % 5 + 1; n > 0; --n) {
                const std::size_t at = 132 + random() % (text.size() - 132);
                if (random() % 2 == 0)
                    text[at] = static_cast<char>(random());
                else
                    text[at] = static_cast<char>(text[at] ^ (1 << (random() % 8)));
            }
            if (random() % 8 == 0) text.resize(random() % text.size());
            // In place: a disk takes milliseconds for each file that is emptied and written anew.
            std::fstream(folder / name, std::ios::binary | std::ios::in | std::ios::out) << text;
            std::filesystem::resize_file(folder / name, text.size());
            try {
                const LabelImage labels = read_labels(folder / name);
                ++read;
                ASSERT_EQ(labels.values.size(),
                          labels.grid.count() * static_cast<std::size_t>(labels.layers));
                ASSERT_TRUE(labels.grid.axes().allFinite() && labels.grid.origin.allFinite());
            } catch (const io::InputError&) {
                ++refused;
            } catch (const std::exception& error) {
                FAIL() << name << ", seed " << seed << ", try " << t << ": " << error.what();
            }
        }
    }
    EXPECT_GT(read, 300);
    EXPECT_GT(refused, 300);
}

namespace {

/// A tube along z in 40 slices of a DICOM CT of 46, from slice 3 to 42 if not through all.
struct TubeInCt {
    CtImage ct;
    test::Segment tube{3, "Aorta", {}};

    explicit TubeInCt(int from = 3, int to = 42) {
        ct.grid.size = {40, 40, 46};
        ct.grid.origin = Vec3(-20, -20, 100);
        for (int a = 0; a < 3; ++a) ct.grid.steps[a] = Vec3::Unit(a);
        for (int k = 0; k < 46; ++k)
            for (int j = 0; j < 40; ++j)
                for (int i = 0; i < 40; ++i) {
                    const Vec3 at = ct.grid.at(i, j, k);
                    const double r = std::hypot(at.x() + 0.3, at.y() - 0.2);
                    tube.marked.push_back(r <= 5 && k >= from && k <= to);
                    ct.hu.push_back(static_cast<std::int16_t>(r <= 5 ? 300 : r < 17 ? 40 : -1000));
                }
    }
};

}  // namespace

TEST_F(DicomSeg, IsImportedIntoTheCtAsNrrdIs) {
    const TubeInCt whole(0, 45), inner;
    test::write_dicom(folder / "ct", whole.ct);
    const auto import = [&](const char* file, bool with_ct, bool any_frame = false) {
        anatomy::MaskSource source;
        source.masks = {folder / file};
        source.labels = {"aorta"};
        if (with_ct) source.ct = folder / "ct";
        source.any_frame = any_frame;
        return anatomy::import_mask(source, {});
    };
    test::SegFile how;
    test::write_seg(folder / "through.dcm", whole.ct.grid, {whole.tube}, how);
    test::write_seg(folder / "inner.dcm", inner.ct.grid, {inner.tube}, how);
    // Where the CT ends, the vessel is cut by its border; the file alone does not tell.
    const std::string cut = "the vessel is cut by the border of the volume";
    const auto said = [](const anatomy::ImportedLumen& lumen) {
        std::string text;
        for (const anatomy::Finding& finding : lumen.findings) text += anatomy::text_of(finding) + "\n";
        return text;
    };
    const anatomy::ImportedLumen through = import("through.dcm", true);
    test::expect_said(said(through), cut);
    EXPECT_EQ(said(through).find("grid is not the CT's"), std::string::npos);
    EXPECT_EQ(through.anatomy.ends.size(), 2u);
    EXPECT_EQ(said(import("inner.dcm", true)).find(cut), std::string::npos);
    EXPECT_EQ(said(import("through.dcm", false)).find(cut), std::string::npos);
    // The same as from another kind of file.
    std::string nrrd =
        "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 40 40 46\nspace "
        "directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (-20,-20,100)\nencoding: "
        "raw\nSegment0_Name:=Aorta\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n\n";
    nrrd.append(inner.tube.marked.begin(), inner.tube.marked.end());
    test::write(folder / "inner.nrrd", nrrd);
    EXPECT_EQ(import("inner.nrrd", true).anatomy.lumen.vertices,
              import("inner.dcm", true).anatomy.lumen.vertices);

    // Other coordinates, by what the files say.
    test::DicomSeries series;
    series.frame_of_reference = "1.2.3.4";
    test::write_dicom(folder / "ct", whole.ct, series);
    test::expect_said(
        said(import("inner.dcm", true)),
        "its frame of reference 1.2.826.0.1.3680043.2.1143.9 is not that of ct, 1.2.3.4; but the "
        "voxels are the same");
    render::VolumeGrid moved = inner.ct.grid;
    moved.origin += Vec3(0.4, 0, 0);
    test::write_seg(folder / "moved.dcm", moved, {inner.tube}, how);
    test::expect_refusal([&] { import("moved.dcm", true); },
                         "moved.dcm: its frame of reference 1.2.826.0.1.3680043.2.1143.9 is not that of ct, "
                         "1.2.3.4; expected a mask in the same coordinates");
    test::expect_said(said(import("moved.dcm", true, true)),
                      "--any-frame was given, so it is taken to lie there");
    how.frame_of_reference = "1.2.3.4";
    test::write_seg(folder / "moved.dcm", moved, {inner.tube}, how);
    test::expect_said(said(import("moved.dcm", true)), "the mask's grid is not the CT's");
    // Two of a name.
    test::Segment small{4, "aorta", std::vector<std::uint8_t>(inner.tube.marked.size(), 0)};
    small.marked[5] = 1;
    test::write_seg(folder / "named.dcm", inner.ct.grid, {inner.tube, small}, how);
    test::expect_refusal(
        [&] { import("named.dcm", true); },
        "--label aorta: several have this name; expected the number of one of them: 3 'Aorta'");
}

}  // namespace patient
