/// CTs as other programs write them: each is read, read with a note, or refused.
/// `--gtest_filter=CtVariants.*` prints the table.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmjpeg/djencode.h>
#include <dcmtk/dcmjpls/djencode.h>
#include <fmt/format.h>
#include <nifti/nifti1.h>
#include <nifti/nifti2.h>
#include <zlib.h>

#include "engine/patient/ct_image.h"
#include "engine/patient/voxelise.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/patient/dicom_writer.h"
#include "tests/engine/patient/seg_writer.h"

namespace patient {
namespace {

using geometry::Vec3;

constexpr int count = 4 * 3 * 2;

/// What the file is to give: 4 × 3 × 2 samples, 1.5 mm apart, the first at (-10, 20, 30) in the axes of
/// DICOM.
CtImage wanted(int slices = 2) {
    CtImage ct;
    ct.grid.size = {4, 3, slices};
    ct.grid.origin = {-10, 20, 30};
    ct.grid.steps = {Vec3(1.5, 0, 0), Vec3(0, 1.5, 0), Vec3(0, 0, 1.5)};
    for (int i = 0; i < 12 * slices; ++i) ct.hu.push_back(static_cast<std::int16_t>(i % 40 * 100 - 1000));
    return ct;
}

enum class Outcome { Read, Note, Refused };

using CtVariants = test::InFolder;

/// Reads, holds what was read against what is wanted, and prints a row.
void expect(const std::filesystem::path& file, const std::string& what, Outcome outcome,
            const std::string& said = {}, const CtImage& right = wanted()) {
    SCOPED_TRACE(what);
    CtImage ct;
    const std::string refusal = test::refusal([&] { ct = read_ct(file); });
    const Outcome found = !refusal.empty()   ? Outcome::Refused
                          : ct.notes.empty() ? Outcome::Read
                                             : Outcome::Note;
    std::string words = !refusal.empty()   ? refusal.substr(refusal.find(": ") + 2)
                        : ct.notes.empty() ? ""
                                           : ct.notes[0];
    std::ranges::replace(words, '\n', ' ');
    std::printf("| %s | %s | %s |\n", what.c_str(),
                found == Outcome::Read   ? "read"
                : found == Outcome::Note ? "note"
                                         : "refused",
                words.c_str());
    ASSERT_EQ(static_cast<int>(found), static_cast<int>(outcome)) << words;
    if (!said.empty()) test::expect_said(words, said);
    if (found == Outcome::Refused) return;
    EXPECT_EQ(ct.grid.size, right.grid.size);
    EXPECT_LT((ct.grid.origin - right.grid.origin).norm(), 1e-3);
    for (int a = 0; a < 3; ++a) EXPECT_LT((ct.grid.steps[a] - right.grid.steps[a]).norm(), 1e-4);
    ASSERT_EQ(ct.hu.size(), right.hu.size());
    for (std::size_t i = 0; i < right.hu.size(); ++i) EXPECT_NEAR(ct.hu[i], right.hu[i], 1) << "sample " << i;
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

namespace {

/// Encoders of DCMTK.
struct Encoders {
    Encoders() {
        DcmRLEEncoderRegistration::registerCodecs();
        DJEncoderRegistration::registerCodecs();
        DJLSEncoderRegistration::registerCodecs();
    }
    ~Encoders() {
        DcmRLEEncoderRegistration::cleanup();
        DJEncoderRegistration::cleanup();
        DJLSEncoderRegistration::cleanup();
    }
};

void put(DcmItem& data, const DcmTagKey& tag, const std::string& text) {
    ASSERT_TRUE(data.putAndInsertString(tag, text.c_str()).good()) << text;
}

}  // namespace

TEST_F(CtVariants, OfDicom) {
    int rows = 0;
    std::filesystem::path at;
    const auto next = [&] { return at = folder / fmt::format("d{}", rows++); };
    using Change = std::function<void(DcmDataset&, int)>;
    const auto series_row = [&](const std::string& what, const test::DicomSeries& series,
                                Outcome outcome = Outcome::Read, const std::string& said = {},
                                const CtImage& ct = wanted()) {
        test::write_dicom(next(), ct, series);
        expect(at, "DICOM, " + what, outcome, said, ct);
    };
    const auto row = [&](const std::string& what, const Change& change, Outcome outcome = Outcome::Read,
                         const std::string& said = {}) {
        test::DicomSeries series;
        series.change = change;
        series_row(what, series, outcome, said);
    };
    const auto all = [](const DcmTagKey& tag, const std::string& text) {
        return [=](DcmDataset& data, int) { put(data, tag, text); };
    };
    /// A series, and what `more` writes into its folder.
    const auto beside = [&](const std::string& what, const std::function<void()>& more,
                            Outcome outcome = Outcome::Read, const std::string& said = {}) {
        test::write_dicom(next(), wanted());
        more();
        expect(at, "DICOM, " + what, outcome, said);
    };
    /// Another series beside it, which differs.
    const auto other = [&](const std::string& uid, const Change& change, const std::string& where = "more") {
        test::DicomSeries series;
        series.uid = uid, series.change = change;
        test::write_dicom(at / where, wanted(), series);
    };

    // Transfer syntaxes.
    const std::pair<const char*, E_TransferSyntax> plain[] = {{"explicit", EXS_LittleEndianExplicit},
                                                              {"implicit", EXS_LittleEndianImplicit},
                                                              {"big-endian", EXS_BigEndianExplicit},
                                                              {"deflated", EXS_DeflatedLittleEndianExplicit}};
    for (const auto& [name, syntax] : plain) {
        test::DicomSeries series;
        series.syntax = syntax;
        series_row(name, series);
    }
    {
        const Encoders encoders;
        const std::pair<const char*, E_TransferSyntax> packed[] = {{"RLE", EXS_RLELossless},
                                                                   {"JPEG, lossless", EXS_JPEGProcess14SV1},
                                                                   {"JPEG-LS", EXS_JPEGLSLossless}};
        for (const auto& [name, syntax] : packed) {
            test::DicomSeries series;
            series.syntax = syntax;
            series.change = [syntax = syntax](DcmDataset& data, int) {
                ASSERT_TRUE(data.chooseRepresentation(syntax, nullptr).good());
            };
            series_row(name, series);
        }
    }
    for (const bool jpeg2000 : {false, true}) {
        test::DicomSeries series;
        series.enhanced = true, series.jpeg2000 = jpeg2000;
        series_row(jpeg2000 ? "enhanced, JPEG 2000" : "enhanced", series);
        series.enhanced = false;
        if (jpeg2000) series_row("JPEG 2000", series);
    }

    // Numbers.
    test::DicomSeries with_sign;
    with_sign.with_sign = true;
    series_row("signed, 16 bits", with_sign);
    const auto words = [](DcmDataset& data, const std::function<int(int stored, int i)>& change) {
        const Uint16* stored = nullptr;
        ASSERT_TRUE(data.findAndGetUint16Array(DCM_PixelData, stored).good());
        std::vector<Uint16> changed;
        for (int i = 0; i < 12; ++i) changed.push_back(static_cast<Uint16>(change(stored[i], i)));
        data.putAndInsertUint16Array(DCM_PixelData, changed.data(), 12);
    };
    row("rubbish above 12 bits",
        [&](DcmDataset& data, int) { words(data, [](int n, int) { return n | 0xA000; }); });
    row("a rescale of its own in each slice", [&](DcmDataset& data, int k) {
        put(data, DCM_RescaleSlope, k == 0 ? "2" : "1");
        put(data, DCM_RescaleIntercept, "-1024");
        words(data, [&](int n, int) { return k == 0 ? n / 2 : n; });
    });
    row("a slope as '+1.0E0 '", all(DCM_RescaleSlope, "+1.0E0"));
    row(
        "no rescale",
        [](DcmDataset& data, int) {
            data.findAndDeleteElement(DCM_RescaleSlope);
            data.findAndDeleteElement(DCM_RescaleIntercept);
        },
        Outcome::Refused, "'' was found for RescaleSlope; expected a finite number");
    row("a slope of 0", all(DCM_RescaleSlope, "0"), Outcome::Refused, "0 was found for RescaleSlope");
    {
        // Padding in the air outside the field of view, and where it would be metal.
        CtImage ct = wanted();
        test::DicomSeries series;
        series.with_sign = true;
        series.change = [&](DcmDataset& data, int) {
            data.putAndInsertSint16(DCM_PixelPaddingValue, -2000);
            words(data, [](int n, int i) { return i == 0 ? -2000 : n; });
        };
        ct.hu[0] = ct.hu[12] = lowest_hu;
        series_row("padding of -2000", series, Outcome::Read, {}, ct);
        series.change = [&](DcmDataset& data, int) {
            data.putAndInsertSint16(DCM_PixelPaddingValue, 0);
            words(data, [](int n, int i) { return i == 3 ? 0 : n; });
        };
        test::write_dicom(next(), wanted(), series);
        ct = wanted();
        ct.hu[3] = ct.hu[15] = ct.hu[10] = -1000;  // the last was 0 HU
        expect(at, "DICOM, padding of 0", Outcome::Note,
               "samples that the file calls padding were taken as air: 3", ct);
        ct = wanted();
        ct.hu[23] = 3500;
        series.change = {};
        test::write_dicom(next(), ct, series);
        ct.hu[23] = highest_hu;
        expect(at, "DICOM, metal above 3071 HU", Outcome::Note,
               "samples above 3071 HU, such as metal, were set to it: 1 (4.17 %)", ct);
    }
    row(
        "8 bits", [](DcmDataset& data, int) { data.putAndInsertUint16(DCM_BitsAllocated, 8); },
        Outcome::Refused, "8 bits in 1 values a sample, 'MONOCHROME2', were found");
    row(
        "32 bits", [](DcmDataset& data, int) { data.putAndInsertUint16(DCM_BitsAllocated, 32); },
        Outcome::Refused, "expected 16 bits");
    row("black for dense", all(DCM_PhotometricInterpretation, "MONOCHROME1"), Outcome::Refused,
        "MONOCHROME1");
    row(
        "colours",
        [](DcmDataset& data, int) {
            put(data, DCM_PhotometricInterpretation, "RGB");
            data.putAndInsertUint16(DCM_SamplesPerPixel, 3);
        },
        Outcome::Refused, "in 3 values a sample, 'RGB'");

    // Places.
    const auto placed = [&](const std::string& what, const geometry::Mat3& axes, bool backwards = false) {
        CtImage ct = wanted();
        for (int a = 0; a < 3; ++a) ct.grid.steps[a] = 1.5 * axes.col(a);
        test::DicomSeries series;
        series.shuffled = backwards;
        series_row(what, series, Outcome::Read, {}, ct);
    };
    geometry::Mat3 axes;
    axes << 0, 0, -1, 1, 0, 0, 0, -1, 0;
    placed("sagittal", axes);
    axes << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    placed("coronal", axes);
    placed("oblique", Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix());
    placed("files in another order", geometry::Mat3::Identity(), true);
    axes = geometry::Mat3::Identity();
    axes.col(2) = Vec3(0, 0.25, 0.97);
    placed("a tilted gantry", axes);
    row(
        "slices that go aside by more than a tilt",
        [](DcmDataset& data, int k) {
            if (k == 1) put(data, DCM_ImagePositionPatient, "-8\\20\\31.5");
        },
        Outcome::Refused, "its slices follow one another 53° from their normal");
    {
        test::DicomSeries series;
        series.change = [](DcmDataset& data, int k) {
            if (k == 2) put(data, DCM_ImagePositionPatient, "-8\\20\\33");
        };
        series_row("a table that wanders", series, Outcome::Refused,
                   "its position is 2.00 mm beside the line of the others", wanted(4));
        series.change = [](DcmDataset& data, int k) {
            put(data, DCM_ImagePositionPatient, fmt::format("-10\\20\\{:.1f}", 30 + 0.625 * k));
        };
        CtImage ct = wanted(9);
        ct.grid.steps[2] = Vec3(0, 0, 0.625);
        series_row("positions to 0.1 mm", series, Outcome::Note, "from equal steps of 0.625 mm", ct);
        test::DicomSeries changing;
        changing.at = {0, 1, 2, 3, 5.2};
        ct = wanted(5);
        test::write_dicom(next(), ct, changing);
        std::vector<std::int16_t> last(ct.hu.end() - 12, ct.hu.end()),
            before(ct.hu.end() - 24, ct.hu.end() - 12);
        ct = wanted(6);
        for (int i = 0; i < 12; ++i)
            for (int k = 4; k < 6; ++k)
                ct.hu[static_cast<std::size_t>(12 * k + i)] = static_cast<std::int16_t>(std::lround(
                    before[static_cast<std::size_t>(i)] +
                    (k - 3) / 2.2 *
                        (last[static_cast<std::size_t>(i)] - before[static_cast<std::size_t>(i)])));
        expect(at, "DICOM, changing steps", Outcome::Note,
               "slices are 1.50 to 3.30 mm apart; they were resampled to 1.50 mm", ct);
        test::DicomSeries gap;
        gap.left_out = {2};
        series_row("a missing slice", gap, Outcome::Refused, "a slice is missing: 3.000 mm lie between",
                   wanted(6));
        gap.left_out = {1};
        series_row("one slice alone", gap, Outcome::Refused, "one slice was found in the series");
    }
    row(
        "steps of 20 mm",
        [](DcmDataset& data, int k) {
            put(data, DCM_ImagePositionPatient, fmt::format("-10\\20\\{}", 30 + 20 * k));
        },
        Outcome::Refused, "samples 20 mm apart along axis 3");
    row("spacing of NaN", all(DCM_PixelSpacing, "nan\\1.5"), Outcome::Refused,
        "'nan\\1.5' was found for PixelSpacing");
    row("spacing of 0", all(DCM_PixelSpacing, "0\\1.5"), Outcome::Refused, "expected two numbers above 0");
    row("negative spacing", all(DCM_PixelSpacing, "-1.5\\1.5"), Outcome::Refused,
        "expected two numbers above 0");
    row("one number of spacing", all(DCM_PixelSpacing, "1.5"), Outcome::Refused, "expected 2 finite numbers");
    row(
        "no position", [](DcmDataset& data, int) { data.findAndDeleteElement(DCM_ImagePositionPatient); },
        Outcome::Refused, "'' was found for ImagePositionPatient; expected 3 finite numbers");
    row("axes that are not perpendicular", all(DCM_ImageOrientationPatient, "1\\0\\0\\0.5\\0.8\\0"),
        Outcome::Refused, "expected two perpendicular unit vectors");
    row(
        "two orientations",
        [](DcmDataset& data, int k) {
            if (k == 1) put(data, DCM_ImageOrientationPatient, "1\\0\\0\\0\\0\\-1");
        },
        Outcome::Refused, "its size, spacing or orientation is not that of");
    row(
        "two sizes of voxels",
        [](DcmDataset& data, int k) {
            if (k == 1) put(data, DCM_PixelSpacing, "1.4\\1.4");
        },
        Outcome::Refused, "its size, spacing or orientation is not that of");
    row(
        "two sizes of slices",
        [](DcmDataset& data, int k) {
            if (k == 1) data.putAndInsertUint16(DCM_Rows, 2);
        },
        Outcome::Refused, "its size, spacing or orientation is not that of");
    row(
        "two frames of reference",
        [](DcmDataset& data, int k) {
            if (k == 1) put(data, DCM_FrameOfReferenceUID, "1.2.3");
        },
        Outcome::Refused, "its frame of reference is not that of");

    // What else lies in a folder.
    beside(
        "a file twice", [&] { std::filesystem::copy_file(at / "IM0003", at / "copy"); }, Outcome::Note,
        "1 slice was left out: copies of other files");
    beside(
        "another image of a place",
        [&] {
            std::filesystem::create_directories(at / "more");
            other("1.2.826.0.1.3680043.2.1143.1",
                  [&](DcmDataset& data, int) { words(data, [](int n, int) { return n / 2; }); });
        },
        Outcome::Refused, "0.000 mm lie between IM0003 and more/IM0003, which differ");
    beside(
        "two series", [&] { other("1.2.3.4", {}); }, Outcome::Refused, "2 series of CT were found");
    beside("a survey view", [&] { other("1.2.3.4", all(DCM_ImageType, "ORIGINAL\\PRIMARY\\LOCALIZER")); });
    beside("pictures of the screen", [&] {
        other("1.2.3.4",
              [](DcmDataset& data, int) { put(data, DCM_SOPClassUID, UID_SecondaryCaptureImageStorage); });
    });
    beside("an MR series", [&] { other("1.2.3.4", all(DCM_Modality, "MR")); });
    beside("a SEG, contours and a report", [&] {
        test::Segment segment{1, "a", std::vector<std::uint8_t>(24, 1)};
        test::write_seg(at / "seg.dcm", wanted().grid, {segment});
        for (const char* modality : {"RTSTRUCT", "SR"})
            other(
                modality[0] == 'R' ? "1.2.3.5" : "1.2.3.6",
                [=](DcmDataset& data, int) {
                    put(data, DCM_Modality, modality);
                    data.findAndDeleteElement(DCM_PixelData);
                },
                modality);
    });
    beside("DICOMDIR, notes and pictures", [&] {
        for (const char* name : {"DICOMDIR", "DESKTOP.INI", "viewer.exe", "a.png"})
            test::write(at / name,
                        "MZ, which is no image at all, and more than one hundred and thirty two bytes long, "
                        "so that it "
                        "could have a mark: it has none");
    });
    beside(
        "an empty file", [&] { test::write(at / "IM0009", ""); }, Outcome::Note,
        "a file in the folder is empty");
    beside(
        "a slice cut off",
        [&] {
            const std::string whole = test::read(at / "IM0003");
            test::write(at / "IM0003", whole.substr(0, whole.size() - 10));
        },
        Outcome::Refused, "expected a whole DICOM file");
    beside("no preamble", [&] {
        for (const char* name : {"IM0003", "IM0010"})
            test::write(at / name, test::read(at / name).substr(132));
    });
    {
        test::DicomSeries series;
        series.syntax = EXS_LittleEndianImplicit;
        test::write_dicom(next(), wanted(), series);
        for (const char* name : {"IM0003", "IM0010"}) {
            DcmFileFormat file;
            ASSERT_TRUE(file.loadFile((at / name).c_str()).good());
            ASSERT_TRUE(file.getDataset()->saveFile((at / name).c_str(), EXS_LittleEndianImplicit).good());
        }
        expect(at, "DICOM, no preamble and no meta header", Outcome::Read);
    }
    row("MR alone", all(DCM_Modality, "MR"), Outcome::Refused, "no slices of CT were found in 2 DICOM files");
    std::filesystem::create_directories(next());
    expect(at, "DICOM, an empty folder", Outcome::Refused, "no slices of CT were found in 0 DICOM files");
    std::printf("%d variants\n", rows);
    EXPECT_GE(rows, 50);
}

}  // namespace patient
