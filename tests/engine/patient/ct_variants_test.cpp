/// CTs as other programs write them: each is read, read with a note, or refused.
/// `--gtest_filter=CtVariants.*` prints the table.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <nifti/nifti1.h>
#include <nifti/nifti2.h>
#include <zlib.h>

#include "engine/patient/ct_image.h"
#include "engine/patient/voxelise.h"
#include "tests/engine/fixtures.h"

namespace patient {
namespace {

using geometry::Vec3;

constexpr int count = 4 * 3 * 2;

/// What the file is to give: 4 × 3 × 2 samples, 1.5 mm apart, the first at (-10, 20, 30) in the axes of
/// DICOM.
CtImage wanted() {
    CtImage ct;
    ct.grid.size = {4, 3, 2};
    ct.grid.origin = {-10, 20, 30};
    ct.grid.steps = {Vec3(1.5, 0, 0), Vec3(0, 1.5, 0), Vec3(0, 0, 1.5)};
    for (int i = 0; i < count; ++i) ct.hu.push_back(static_cast<std::int16_t>(i * 100 - 1000));
    return ct;
}

enum class Outcome { Read, Note, Refused };

using CtVariants = test::InFolder;

/// Reads, holds what was read against what is wanted, and prints a row.
void expect(const std::filesystem::path& file, const std::string& what, Outcome outcome,
            const std::string& said = {}) {
    SCOPED_TRACE(what);
    CtImage ct;
    const std::string refusal = test::refusal([&] { ct = read_ct(file); });
    const Outcome found = !refusal.empty()   ? Outcome::Refused
                          : ct.notes.empty() ? Outcome::Read
                                             : Outcome::Note;
    const std::string words = !refusal.empty()   ? refusal.substr(refusal.find(": ") + 2)
                              : ct.notes.empty() ? ""
                                                 : ct.notes[0];
    std::printf("| %s | %s | %s |\n", what.c_str(),
                found == Outcome::Read   ? "read"
                : found == Outcome::Note ? "note"
                                         : "refused",
                words.c_str());
    ASSERT_EQ(static_cast<int>(found), static_cast<int>(outcome)) << words;
    if (!said.empty()) test::expect_said(words, said);
    if (found == Outcome::Refused) return;
    const CtImage right = wanted();
    EXPECT_EQ(ct.grid.size, right.grid.size);
    EXPECT_LT((ct.grid.origin - right.grid.origin).norm(), 1e-3);
    for (int a = 0; a < 3; ++a) EXPECT_LT((ct.grid.steps[a] - right.grid.steps[a]).norm(), 1e-4);
    for (int i = 0; i < count; ++i) EXPECT_NEAR(ct.hu[i], right.hu[i], 1) << "sample " << i;
}

template <class Stored>
std::string samples(double slope = 1, double intercept = 0, bool turned = false) {
    std::string bytes;
    for (const std::int16_t hu : wanted().hu) {
        const auto number = static_cast<Stored>((hu - intercept) / slope);
        std::string one(reinterpret_cast<const char*>(&number), sizeof number);
        if (turned) std::reverse(one.begin(), one.end());
        bytes += one;
    }
    return bytes;
}

std::string gzipped(const std::string& text) {
    std::string packed(text.size() + 1000, '\0');
    z_stream stream{};
    deflateInit2(&stream, 9, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream.avail_in = static_cast<uInt>(text.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

nifti_1_header nifti() {
    nifti_1_header h{};
    h.sizeof_hdr = sizeof h;
    const short dim[8] = {3, 4, 3, 2, 1, 1, 1, 1};
    std::memcpy(h.dim, dim, sizeof dim);
    const float pixdim[8] = {1, 1.5f, 1.5f, 1.5f, 0, 0, 0, 0};
    std::memcpy(h.pixdim, pixdim, sizeof pixdim);
    h.datatype = DT_INT16, h.bitpix = 16;
    h.vox_offset = 352;
    h.xyzt_units = NIFTI_UNITS_MM;
    h.sform_code = 1;
    h.srow_x[0] = -1.5f, h.srow_x[3] = 10;
    h.srow_y[1] = -1.5f, h.srow_y[3] = -20;
    h.srow_z[2] = 1.5f, h.srow_z[3] = 30;
    std::memcpy(h.magic, "n+1", 4);
    return h;
}

std::string with_header(const nifti_1_header& h, const std::string& bytes, std::size_t begin = 352) {
    std::string text(begin, '\0');
    std::memcpy(text.data(), &h, sizeof h);
    return text + bytes;
}

std::string nrrd(const std::string& more, const std::string& data = {}, const std::string& type = "short",
                 const std::string& place =
                     "space: left-posterior-superior\nspace directions: (1.5,0,0) (0,1.5,0) (0,0,1.5)\n"
                     "space origin: (-10,20,30)\n") {
    return "NRRD0004\ntype: " + type + "\ndimension: 3\nsizes: 4 3 2\n" + place + more + "\n" + data;
}

}  // namespace

TEST_F(CtVariants, OfNifti) {
    const auto row = [&](const std::string& what, const std::function<void(nifti_1_header&)>& change,
                         const std::string& bytes, Outcome outcome = Outcome::Read,
                         const std::string& said = {}) {
        nifti_1_header h = nifti();
        change(h);
        test::write(folder / "a.nii", with_header(h, bytes));
        expect(folder / "a.nii", "NIfTI, " + what, outcome, said);
    };
    const auto same = [](nifti_1_header&) {};
    const std::string plain = samples<std::int16_t>();
    const auto typed = [](int type, int bits) {
        return [=](nifti_1_header& h) {
            h.datatype = static_cast<short>(type), h.bitpix = static_cast<short>(bits);
        };
    };
    row("16 bits", same, plain);
    row("32 bits", typed(DT_INT32, 32), samples<std::int32_t>());
    row("64 bits", typed(DT_INT64, 64), samples<std::int64_t>());
    row("float", typed(DT_FLOAT32, 32), samples<float>());
    row("double", typed(DT_FLOAT64, 64), samples<double>());
    row(
        "unsigned with an intercept",
        [](nifti_1_header& h) { h.datatype = DT_UINT16, h.scl_slope = 1, h.scl_inter = -1024; },
        samples<std::uint16_t>(1, -1024));
    row(
        "8 bits with a slope",
        [](nifti_1_header& h) {
            h.datatype = DT_UINT8, h.bitpix = 8, h.scl_slope = 100, h.scl_inter = -1000;
        },
        samples<std::uint8_t>(100, -1000));
    row(
        "a slope of 0", [](nifti_1_header& h) { h.scl_slope = 0, h.scl_inter = 7; }, plain);
    row(
        "a slope of 2", [](nifti_1_header& h) { h.scl_slope = 2; }, samples<std::int16_t>(2));
    row(
        "a slope of -1", [](nifti_1_header& h) { h.scl_slope = -1; }, samples<std::int16_t>(-1));
    row(
        "metres",
        [](nifti_1_header& h) {
            h.xyzt_units = NIFTI_UNITS_METER;
            for (float* r : {h.srow_x, h.srow_y, h.srow_z})
                for (int k = 0; k < 4; ++k) r[k] *= 1e-3f;
        },
        plain);
    row(
        "microns",
        [](nifti_1_header& h) {
            h.xyzt_units = NIFTI_UNITS_MICRON;
            for (float* r : {h.srow_x, h.srow_y, h.srow_z})
                for (int k = 0; k < 4; ++k) r[k] *= 1e3f;
        },
        plain);
    row(
        "no unit", [](nifti_1_header& h) { h.xyzt_units = 0; }, plain);
    row(
        "a fourth dimension of 1", [](nifti_1_header& h) { h.dim[0] = 4; }, plain);
    row(
        "seven dimensions, all of 1", [](nifti_1_header& h) { h.dim[0] = 7; }, plain);
    row(
        "sizes beyond its dimensions", [](nifti_1_header& h) { h.dim[4] = 9; }, plain);
    row(
        "steps of pixdim that lie", [](nifti_1_header& h) { h.pixdim[1] = 99; }, plain);
    row(
        "a quaternion alone",
        [](nifti_1_header& h) {
            h.sform_code = 0, h.qform_code = 1, h.quatern_d = 1;
            h.qoffset_x = 10, h.qoffset_y = -20, h.qoffset_z = 30;
        },
        plain);
    row(
        "a quaternion that agrees",
        [](nifti_1_header& h) {
            h.qform_code = 2, h.quatern_d = 1;
            h.qoffset_x = 10, h.qoffset_y = -20, h.qoffset_z = 30;
        },
        plain);
    row(
        "a quaternion 40 mm apart",
        [](nifti_1_header& h) {
            h.qform_code = 2, h.quatern_d = 1;
            h.qoffset_x = 50, h.qoffset_y = -20, h.qoffset_z = 30;
        },
        plain, Outcome::Note, "up to 40 mm apart");
    row(
        "samples at byte 0", [](nifti_1_header& h) { h.vox_offset = 0; }, plain);
    row("bytes behind the samples", same, plain + "rubbish");
    {
        std::string floats = samples<float>();
        const float nan = std::nanf("");
        std::memcpy(floats.data(), &nan, sizeof nan);  // the first is air
        row("NaN around it", typed(DT_FLOAT32, 32), floats, Outcome::Note,
            "no numbers were taken as air: 1 (4.17 %)");
    }
    {
        nifti_1_header h = nifti();
        h.vox_offset = 352 + 32;
        std::string text = with_header(h, {}, 352 + 32);
        text[348] = 1;  // an extension of 32 bytes follows
        const std::int32_t size = 32, code = 6;
        std::memcpy(text.data() + 352, &size, 4), std::memcpy(text.data() + 356, &code, 4);
        test::write(folder / "a.nii", text + plain);
        expect(folder / "a.nii", "NIfTI, an extension", Outcome::Read);
    }
    const std::string whole = with_header(nifti(), plain);
    test::write(folder / "a.nii.gz", gzipped(whole));
    expect(folder / "a.nii.gz", "NIfTI, gzip", Outcome::Read);
    test::write(folder / "b.nii", gzipped(whole));
    expect(folder / "b.nii", "NIfTI, gzip named .nii", Outcome::Read);
    test::write(folder / "c.nii.gz", whole);
    expect(folder / "c.nii.gz", "NIfTI, plain named .nii.gz", Outcome::Read);
    test::write(folder / "d.nii.gz", gzipped(whole.substr(0, 360)) + gzipped(whole.substr(360)));
    expect(folder / "d.nii.gz", "NIfTI, two members of gzip", Outcome::Read);
    {
        nifti_1_header h = nifti();
        h.vox_offset = 0;
        std::memcpy(h.magic, "ni1", 4);
        test::write(folder / "p.hdr", with_header(h, {}, sizeof h));
        test::write(folder / "p.img", plain);
        expect(folder / "p.hdr", "NIfTI, a pair .hdr and .img", Outcome::Read);
    }
    row(
        "a fourth dimension of 2", [](nifti_1_header& h) { h.dim[0] = 4, h.dim[4] = 2; }, plain + plain,
        Outcome::Refused, "save one volume in a file");
    row(
        "no place", [](nifti_1_header& h) { h.sform_code = 0; }, plain, Outcome::Refused,
        "neither its qform nor its sform");
    row("colours", typed(DT_RGB24, 24), plain + plain, Outcome::Refused, "samples of type 128");
    row(
        "an infinite sample", typed(DT_FLOAT32, 32),
        [] {
            std::string floats = samples<float>();
            const float infinite = INFINITY;
            std::memcpy(floats.data() + 8, &infinite, sizeof infinite);
            return floats;
        }(),
        Outcome::Refused, "an infinite value");
    row("too few samples", same, plain.substr(2), Outcome::Refused, "the data end after 398 of 400 bytes");
    row(
        "raw numbers without their rescale", [](nifti_1_header& h) { h.datatype = DT_UINT16; },
        samples<std::uint16_t>(1, -1024), Outcome::Refused, "raw values without their rescale");
}

TEST_F(CtVariants, OfNrrd) {
    const std::string plain = samples<std::int16_t>(), little = "endian: little\n",
                      raw = little + "encoding: raw\n";
    std::string text, comma;
    for (const std::int16_t hu : wanted().hu)
        text += std::to_string(hu) + "\n", comma += std::to_string(hu) + ", ";
    const auto row = [&](const std::string& what, const std::string& file, Outcome outcome = Outcome::Read,
                         const std::string& said = {}) {
        test::write(folder / "a.nrrd", file);
        expect(folder / "a.nrrd", "NRRD, " + what, outcome, said);
    };
    const auto placed = [](const std::string& space, const char* first, const char* origin) {
        return "space: " + space + "\nspace directions: " + first + " (0,0,1.5)\nspace origin: " + origin +
               "\n";
    };
    row("raw", nrrd(raw, plain));
    row("big-endian", nrrd("endian: big\nencoding: raw\n", samples<std::int16_t>(1, 0, true)));
    row("gzip", nrrd(little + "encoding: gzip\n", gzipped(plain)));
    row("gz", nrrd(little + "encoding: gz\n", gzipped(plain)));
    row("ascii", nrrd("encoding: ascii\n", text));
    row("text with commas", nrrd("encoding: txt\n", comma));
    row("float", nrrd(raw, samples<float>(), "float"));
    row("double", nrrd(raw, samples<double>(), "double"));
    row("signed char's longer kin", nrrd(raw, samples<std::int32_t>(), "signed int"));
    row("64 bits", nrrd(raw, samples<std::int64_t>(), "long long int"));
    row("a byte skip of -1", nrrd(raw + "byte skip: -1\n", "some rubbish" + plain));
    row("a line skip", nrrd(raw + "line skip: 2\n", "one\ntwo\n" + plain));
    row("lines that end as in Windows", [&] {
        std::string dos;
        for (const char c : nrrd("encoding: ascii\n"))
            dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
        return dos + text;
    }());
    row("remarks and keys of its own", nrrd("# a remark\nmodality:=CT\n" + raw, plain));
    row("a measurement frame", nrrd("measurement frame: (1,0,0) (0,1,0) (0,0,1)\n" + raw, plain));
    row("units of mm", nrrd("space units: \"mm\" \"mm\" \"mm\"\n" + raw, plain));
    row("RAS",
        nrrd(raw, plain, "short", placed("right-anterior-superior", "(-1.5,0,0) (0,-1.5,0)", "(10,-20,30)")));
    row("LAS", nrrd(raw, plain, "short", placed("LAS", "(1.5,0,0) (0,-1.5,0)", "(-10,-20,30)")));
    {
        test::write(folder / "a.raw", plain);
        test::write(folder / "a.nhdr", nrrd(raw + "data file: a.raw\n"));
        expect(folder / "a.nhdr", "NRRD, samples in a file of their own", Outcome::Read);
        test::write(folder / "a1.raw", plain.substr(0, 24));
        test::write(folder / "a2.raw", plain.substr(24));
        test::write(folder / "a.nhdr", nrrd(raw + "data file: LIST\na1.raw\na2.raw"));
        expect(folder / "a.nhdr", "NRRD, a list of files", Outcome::Read);
        test::write(folder / "a.nhdr", nrrd(raw + "data file: a%d.raw 1 2 1\n"));
        expect(folder / "a.nhdr", "NRRD, a pattern of files", Outcome::Read);
    }
    row(
        "NaN around it",
        [&] {
            std::string floats = samples<float>();
            const float nan = std::nanf("");
            std::memcpy(floats.data(), &nan, sizeof nan);
            return nrrd(raw, floats, "float");
        }(),
        Outcome::Note, "no numbers were taken as air");
    row("no space", nrrd(raw, plain, "short", "spacings: 1.5 1.5 1.5\n"), Outcome::Refused,
        "no 'space' was found");
    row(
        "four dimensions",
        [&] {
            std::string four = nrrd(raw, plain);
            four.replace(four.find("dimension: 3"), 12, "dimension: 4");
            return four;
        }(),
        Outcome::Refused, "save one volume in a file");
    row("too few samples", nrrd(raw, plain.substr(2)), Outcome::Refused, "asks for 48 bytes");
    row("raw numbers without their rescale", nrrd(raw, samples<std::uint16_t>(1, -1024), "ushort"),
        Outcome::Refused, "raw values without their rescale");
}

}  // namespace patient
