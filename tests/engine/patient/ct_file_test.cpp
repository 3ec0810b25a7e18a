/// CT files of each kind, whole and damaged.

#include <algorithm>
#include <bzlib.h>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <nifti/nifti1.h>
#include <random>
#include <unistd.h>
#include <zlib.h>

#include "engine/io/wall.h"
#include "engine/patient/ct_image.h"
#include "engine/patient/patient_files.h"
#include "engine/patient/voxelise.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/patient/dicom_writer.h"

namespace patient {
namespace {

using geometry::Vec3;

/// Oblique, with steps of three lengths, and no two values alike along an axis.
CtImage small_ct() {
    CtImage ct;
    const geometry::Mat3 turn =
        (Eigen::AngleAxisd(0.3, Vec3::UnitX()) * Eigen::AngleAxisd(-0.2, Vec3::UnitZ())).toRotationMatrix();
    ct.grid.size = {7, 5, 6};
    ct.grid.origin = Vec3(-20.5, 31.25, 1200.125);
    ct.grid.steps = {0.75 * turn.col(0), 0.5 * turn.col(1), 1.25 * turn.col(2)};
    for (int i = 0; i < 7 * 5 * 6; ++i) ct.hu.push_back(static_cast<std::int16_t>((i * 73) % 3000 - 1000));
    return ct;
}

void expect_same(const CtImage& read, const CtImage& written, double within) {
    EXPECT_EQ(read.grid.size, written.grid.size);
    EXPECT_LT((read.grid.origin - written.grid.origin).norm(), within);
    for (int a = 0; a < 3; ++a)
        EXPECT_LT((read.grid.steps[a] - written.grid.steps[a]).norm(), within) << "axis " << a;
    EXPECT_EQ(read.hu, written.hu);
}

/// In place: a disk takes milliseconds for each file that is emptied and written anew.
void overwrite(const std::filesystem::path& path, const std::string& text) {
    std::fstream(path, std::ios::binary | std::ios::in | std::ios::out) << text;
    std::filesystem::resize_file(path, text.size());
}

std::string refused(const std::filesystem::path& path, const std::string& series = {}) {
    return test::refusal([&] { read_ct(path, series); });
}

}  // namespace

using CtFile = test::InFolder;

TEST_F(CtFile, EachKindGivesBackPlacesAndValues) {
    const CtImage ct = small_ct();
    for (const char* name : {"a.nii", "a.nii.gz", "a.nrrd"}) {
        write_ct(folder / name, ct);
        expect_same(read_ct(folder / name), ct, 1e-4);  // NIfTI keeps floats
    }
    test::write_dicom(folder / "dicom", ct);
    expect_same(read_ct(folder / "dicom"), ct, 1e-5);
    test::DicomSeries with_sign;
    with_sign.with_sign = true;
    test::write_dicom(folder / "signed", ct, with_sign);
    expect_same(read_ct(folder / "signed"), ct, 1e-5);
}

TEST_F(CtFile, NiftiPlacesVoxelsByItsQuaternionAndUnitAndRescales) {
    CtImage ct = small_ct();
    write_ct(folder / "a.nii", ct);
    std::string text = test::read(folder / "a.nii");
    nifti_1_header header;
    std::memcpy(&header, text.data(), sizeof header);
    header.sform_code = 0;
    header.qform_code = 1;
    header.quatern_b = header.quatern_c = 0;
    header.quatern_d = 1;  // half a turn about z: +i to the left, +j to the back
    header.qoffset_x = 10, header.qoffset_y = 20, header.qoffset_z = 30;
    for (int a = 1; a < 4; ++a) header.pixdim[a] = 0.002f;
    header.qoffset_x = 0.010f, header.qoffset_y = 0.020f, header.qoffset_z = 0.030f;
    header.xyzt_units = NIFTI_UNITS_METER;
    header.scl_slope = 0.5f;
    header.scl_inter = -500;
    std::memcpy(text.data(), &header, sizeof header);
    test::write(folder / "b.nii", text);
    const CtImage read = read_ct(folder / "b.nii");
    EXPECT_LT((read.grid.origin - Vec3(-10, -20, 30)).norm(), 1e-4);
    EXPECT_LT((read.grid.steps[0] - Vec3(2, 0, 0)).norm(), 1e-4);
    EXPECT_LT((read.grid.steps[1] - Vec3(0, 2, 0)).norm(), 1e-4);
    EXPECT_LT((read.grid.steps[2] - Vec3(0, 0, 2)).norm(), 1e-4);
    for (std::size_t i = 0; i < ct.hu.size(); ++i) EXPECT_NEAR(read.hu[i], 0.5 * ct.hu[i] - 500, 0.51);
    // Nothing that says where it is.
    header.qform_code = 0;
    std::memcpy(text.data(), &header, sizeof header);
    test::write(folder / "c.nii", text);
    test::expect_said(refused(folder / "c.nii"), "neither its qform nor its sform");
}

TEST_F(CtFile, NrrdIsReadInEachSpaceTypeEncodingAndOrderOfBytes) {
    const auto header = [](const std::string& type, const std::string& space, const std::string& rest) {
        return "NRRD0005\n# made by hand\ntype: " + type + "\ndimension: 3\nspace: " + space +
               "\nsizes: 2 2 2\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (10,20,30)\n"
               "kinds: domain domain domain\nname:=value\n" +
               rest;
    };
    const std::vector<int> values = {-1000, 0, 40, 1500, -100, 3071, 1, -1};
    std::string listed;
    for (const int v : values) listed += std::to_string(v) + " ";
    test::write(folder / "a.nrrd",
                header("short", "left-posterior-superior", "encoding: ascii\n\n") + listed);
    const CtImage ascii = read_ct(folder / "a.nrrd");
    EXPECT_EQ(std::vector<int>(ascii.hu.begin(), ascii.hu.end()), values);
    EXPECT_EQ(ascii.grid.origin, Vec3(10, 20, 30));
    EXPECT_EQ(ascii.grid.steps[1], Vec3(0, 2, 0));

    std::string big, floats;
    for (const int v : values) {
        big += static_cast<char>((v >> 8) & 255);
        big += static_cast<char>(v & 255);
        const auto f = static_cast<float>(v);
        floats.append(reinterpret_cast<const char*>(&f), sizeof f);
    }
    test::write(folder / "b.nrrd", header("int16", "RAS", "endian: big\nencoding: raw\n\n") + big);
    const CtImage ras = read_ct(folder / "b.nrrd");
    EXPECT_EQ(ras.hu, ascii.hu);
    EXPECT_EQ(ras.grid.origin, Vec3(-10, -20, 30));
    EXPECT_EQ(ras.grid.steps[0], Vec3(-1, 0, 0));
    // Detached, behind other bytes.
    test::write(folder / "c.raw", "12345" + floats);
    test::write(folder / "c.nhdr",
                header("float", "LAS", "endian: little\nencoding: raw\nbyte skip: -1\ndata file: c.raw\n"));
    const CtImage las = read_ct(folder / "c.nhdr");
    EXPECT_EQ(las.hu, ascii.hu);
    EXPECT_EQ(las.grid.origin, Vec3(10, -20, 30));
    const std::uint64_t before = content_hash(folder / "c.nhdr");
    test::write(folder / "c.raw", "12346" + floats);
    EXPECT_NE(content_hash(folder / "c.nhdr"), before);

    // What is refused says what is accepted.
    const std::pair<std::string, std::string> wrong[] = {
        {header("block", "LPS", "encoding: ascii\n\n") + listed, "'type: block' was found"},
        {header("short", "scanner-xyz", "encoding: ascii\n\n") + listed, "right-anterior-superior"},
        {header("short", "LPS", "encoding: lzma\n\n") + listed, "raw, gzip, bzip2, hex or ascii"},
        {header("short", "LPS", "endian: little\nencoding: bzip2\n\n") + listed,
         "the compressed data are damaged"},
        {header("short", "LPS", "endian: little\nencoding: hex\n\n") +
             "18FC 0000 28 0x 0000 0000 0000 0000 0000 0000",
         "are damaged"},
        {header("short", "LPS", "encoding: ascii\nline skip: 3\n\n") + listed, "the file ends after"},
        {header("short", "LPS", "endian: little\nencoding: raw\ndata file: s%d.raw 1 3\n"),
         "such as slice%03d.raw 1 65 1"},
        {header("short", "LPS", "endian: little\nencoding: raw\ndata file: LIST\n"),
         "expected the names of files behind it"},
        {header("short", "LPS", "endian: little\nencoding: raw\ndata file: LIST\na\nb\nc\n"),
         "expected as many samples in each of 3 files, of 8 in all"},
        {header("short", "LPS", "encoding: raw\n\n") + big, "no 'endian' was found"},
        {header("short", "LPS", "encoding: raw\nendian: big\n\n") + big.substr(3), "asks for 16 bytes"},
        {header("short", "LPS", "encoding: ascii\n\n") + "1 2 3 4 5 x 7 8 ", "'x' was found for sample 5"},
        {header("float", "LPS", "encoding: ascii\n\n") + "1 2 3 4 5 inf 7 8", "a finite number"},
        {header("short", "LPS", "encoding: ascii\nspace units: \"m\" \"m\" \"m\"\n\n") + listed,
         "expected mm"},
        {"hello", "no header of NRRD"}};
    for (const auto& [text, said] : wrong) {
        test::write(folder / "w.nrrd", text);
        test::expect_said(refused(folder / "w.nrrd"), said);
    }
}

TEST_F(CtFile, NrrdIsReadFromEveryKindOfDataFile) {
    const CtImage ct = small_ct();
    const std::string start =
        "NRRD0005\ntype: short\ndimension: 3\nspace: LPS\nsizes: 7 5 6\nspace directions: (0.75,0,0) "
        "(0,0.5,0) "
        "(0,0,1.25)\nspace origin: (1,2,3)\nendian: little\n";
    const std::string bytes(reinterpret_cast<const char*>(ct.hu.data()), 2 * ct.hu.size());
    std::string hex, packed(2 * bytes.size() + 600, '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i)
        hex += fmt::format("{:02x}{}", static_cast<unsigned char>(bytes[i]), i % 20 == 19 ? "\n" : "");
    auto size = static_cast<unsigned>(packed.size());
    ASSERT_EQ(BZ2_bzBuffToBuffCompress(packed.data(), &size, const_cast<char*>(bytes.data()),
                                       static_cast<unsigned>(bytes.size()), 9, 0, 0),
              BZ_OK);
    packed.resize(size);
    for (int k = 0; k < 6; ++k) {
        const std::string slice = bytes.substr(static_cast<std::size_t>(70 * k), 70);
        test::write(folder / fmt::format("s{:03}.raw", k), slice);
        test::write(folder / fmt::format("l{}.raw", k), "two lines\nbefore it\n" + slice);
    }
    const std::pair<const char*, std::string> files[] = {
        {"hex.nrrd", start + "encoding: hex\n\n" + hex},
        {"bzip2.nrrd", start + "encoding: bzip2\n\n" + packed},
        {"list.nhdr",
         start +
             "encoding: raw\ndata file: LIST\ns000.raw\ns001.raw\ns002.raw\ns003.raw\ns004.raw\ns005.raw\n"},
        {"pattern.nhdr", start + "encoding: raw\ndata file: s%03d.raw 0 5 1\n"},
        {"lines.nhdr", start + "encoding: raw\nline skip: 2\ndata file: l%d.raw 0 5 1\n"}};
    for (const auto& [name, text] : files) {
        SCOPED_TRACE(name);
        test::write(folder / name, text);
        EXPECT_EQ(read_ct(folder / name).hu, ct.hu);
    }
    // What the samples are in is part of the CT.
    for (const char* name : {"list.nhdr", "pattern.nhdr"}) {
        const std::uint64_t before = content_hash(folder / name);
        test::write(folder / "s004.raw", std::string(70, 'x'));
        EXPECT_NE(content_hash(folder / name), before) << name;
        test::write(folder / "s004.raw", bytes.substr(280, 70));
    }
    PatientFiles of_list;
    of_list.ct = folder / "list.nhdr";
    EXPECT_EQ(inputs_of(of_list).size(), 7u);
}

TEST_F(CtFile, MetaImagesGiveBackPlacesAndValues) {
    const CtImage ct = small_ct();
    const geometry::Mat3 axes = ct.grid.axes();
    std::string matrix;
    for (int a = 0; a < 3; ++a)
        for (int row = 0; row < 3; ++row)
            matrix += fmt::format(" {:.12f}", axes(row, a) / axes.col(a).norm());
    const std::string start = fmt::format(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix ={}\nOffset = {:.12f} {:.12f} "
        "{:.12f}\n"
        "ElementSpacing = 0.75 0.5 1.25\nDimSize = 7 5 6\n",
        matrix, ct.grid.origin.x(), ct.grid.origin.y(), ct.grid.origin.z());
    const std::string bytes(reinterpret_cast<const char*>(ct.hu.data()), 2 * ct.hu.size());
    std::string turned, floats, packed(2 * bytes.size() + 600, '\0');
    for (std::size_t i = 0; i < bytes.size(); i += 2) turned += {bytes[i + 1], bytes[i]};
    for (const std::int16_t hu : ct.hu) {
        const auto f = static_cast<float>(hu);
        floats.append(reinterpret_cast<const char*>(&f), sizeof f);
    }
    uLongf size = packed.size();
    ASSERT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size,
                       reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
              Z_OK);
    packed.resize(size);
    const std::string last = "ElementDataFile = ";
    test::write(folder / "d.raw", "12345" + bytes);
    test::write(folder / "d.zraw", packed);
    const std::pair<const char*, std::string> files[] = {
        {"a.mha", start + "ElementType = MET_SHORT\n" + last + "LOCAL\n" + bytes},
        {"b.mha",
         start + "BinaryDataByteOrderMSB = True\nElementType = MET_SHORT\n" + last + "LOCAL\n" + turned},
        {"c.mha", start + "ElementType = MET_FLOAT\n" + last + "LOCAL\n" + floats},
        {"d.mhd", start + "ElementType = MET_SHORT\nHeaderSize = -1\n" + last + "d.raw\n"},
        {"e.mhd", start + "ElementType = MET_SHORT\nHeaderSize = 5\n" + last + "d.raw"},
        {"f.mhd", start + "ElementType = MET_SHORT\nCompressedData = True\n" + last + "d.zraw\n"},
        {"g.mha", start + "ElementType = MET_SHORT\nCompressedData = True\n" + last + "LOCAL\n" + packed}};
    for (const auto& [name, text] : files) {
        SCOPED_TRACE(name);
        test::write(folder / name, text);
        expect_same(read_ct(folder / name), ct, 1e-6);
    }
    const std::pair<std::string, const char*> wrong[] = {
        {start + last + "LOCAL\n", "no 'elementtype' was found"},
        {start + "ElementType = MET_SHORT\n", "no 'ElementDataFile' was found"},
        {start + "ElementType = MET_SHORT\n" + last + "LIST\n", "LOCAL or the name of one file"},
        {start + "ElementType = MET_SHORT\n" + last + "LOCAL\n" + bytes.substr(2), "asks for 420 bytes"},
        {"NDims = 3\nDimSize = 7 5 6\nElementType = MET_SHORT\n" + last + "LOCAL\n" + bytes,
         "expected Offset and ElementSpacing"},
        {"NDims = 4\nElementType = MET_SHORT\n" + last + "LOCAL\n", "save one volume in a file"},
        {"hello\n", "the line 'hello' was found"}};
    for (const auto& [text, said] : wrong) {
        test::write(folder / "w.mha", text);
        test::expect_said(refused(folder / "w.mha"), said);
    }
}

TEST_F(CtFile, NiftiPairsFirstBytesOfZeroNanAndTwoPlacesAreReadAndTold) {
    const CtImage ct = small_ct();
    write_ct(folder / "a.nii", ct);
    const std::string whole = test::read(folder / "a.nii");
    nifti_1_header header;
    std::memcpy(&header, whole.data(), sizeof header);
    const auto with = [&](const std::string& samples, bool apart = false) {
        std::string text(352, '\0');
        std::memcpy(text.data(), &header, sizeof header);
        return apart ? text.substr(0, sizeof header) : text + samples;
    };
    const std::string samples = whole.substr(static_cast<std::size_t>(header.vox_offset));
    header.vox_offset = 0;
    test::write(folder / "zero.nii", with(samples));
    expect_same(read_ct(folder / "zero.nii"), ct, 1e-4);

    std::memcpy(header.magic, "ni1", 4);
    test::write(folder / "pair.hdr", with({}, true));
    test::expect_said(refused(folder / "pair.hdr"),
                      "no file with its samples lies beside it; expected pair.img");
    test::write(folder / "pair.img", samples);
    for (const char* name : {"pair.hdr", "pair.img"}) expect_same(read_ct(folder / name), ct, 1e-4);
    std::memcpy(header.magic, "n+1", 4);

    header.qform_code = 1;
    header.quatern_b = header.quatern_c = header.quatern_d = 0;
    header.qoffset_x = header.srow_x[3] + 40;
    header.qoffset_y = header.srow_y[3];
    header.qoffset_z = header.srow_z[3];
    test::write(folder / "two.nii", with(samples));
    const CtImage two = read_ct(folder / "two.nii");
    expect_same(two, ct, 1e-4);
    ASSERT_EQ(two.notes.size(), 1u);
    test::expect_said(two.notes[0], "its sform and its qform place it up to");
    header.qform_code = 0;

    // What a resampled volume has around it.
    header.datatype = DT_FLOAT32, header.bitpix = 32;
    std::string floats;
    for (std::size_t i = 0; i < ct.hu.size(); ++i) {
        const float f = i % 7 == 0 ? std::nanf("") : static_cast<float>(ct.hu[i]);
        floats.append(reinterpret_cast<const char*>(&f), sizeof f);
    }
    test::write(folder / "nan.nii", with(floats));
    const CtImage padded = read_ct(folder / "nan.nii");
    for (std::size_t i = 0; i < ct.hu.size(); ++i) EXPECT_EQ(padded.hu[i], i % 7 == 0 ? -1000 : ct.hu[i]);
    ASSERT_EQ(padded.notes.size(), 1u);
    EXPECT_EQ(padded.notes[0], "samples that are no numbers were taken as air: 30 (14.3 %)");
}

TEST_F(CtFile, DicomSeriesAreChosenAndGapsNamed) {
    CtImage ct = small_ct();
    test::DicomSeries arterial, venous;
    venous.uid += "9";
    venous.number = "4";
    venous.description = "VENOUS 3.0";
    test::write_dicom(folder / "two", ct, arterial);
    for (std::int16_t& hu : ct.hu) hu = static_cast<std::int16_t>(hu / 2);
    ct.hu[0] = -1000;
    test::write_dicom(std::filesystem::path(folder / "two") / "deeper", ct, venous);
    test::write(std::filesystem::path(folder / "two") / "README.txt", "not DICOM");
    const std::string said = refused(folder / "two");
    test::expect_said(said, "2 series of CT were found");
    test::expect_said(said, "number 3, 'ANGIO 0.75', 6 slices of 7 × 5");
    test::expect_said(said, "number 4, 'VENOUS 3.0'");
    expect_same(read_ct(folder / "two", "4"), ct, 1e-5);
    expect_same(read_ct(folder / "two", "VENOUS 3.0"), ct, 1e-5);
    expect_same(read_ct(folder / "two", venous.uid), ct, 1e-5);
    test::expect_said(refused(folder / "two", "5"), "0 series fit '5'");

    test::DicomSeries gap;
    gap.left_out = {2};
    test::write_dicom(folder / "gap", ct, gap);
    test::expect_said(refused(folder / "gap"),
                      "a slice is missing: 2.500 mm lie between IM0010 and IM0024, 1.250 mm between most");
    test::write_dicom(folder / "double", ct);
    std::filesystem::copy_file(std::filesystem::path(folder / "double") / "IM0003",
                               std::filesystem::path(folder / "double") / "copy");
    const CtImage once = read_ct(folder / "double");
    expect_same(once, ct, 1e-5);
    EXPECT_EQ(once.notes, std::vector<std::string>{"1 slice was left out: copies of other files"});
    // Another image of the same place is another phase.
    CtImage later = ct;
    for (std::int16_t& hu : later.hu) hu = static_cast<std::int16_t>(hu / 3 * 2);
    test::DicomSeries phase;
    phase.left_out = {0, 1, 2, 3, 5};
    test::write_dicom(std::filesystem::path(folder / "double") / "later", later, phase);
    test::expect_said(refused(folder / "double"), "0.000 mm lie between IM0031 and");
    test::expect_said(refused(folder / "double"), "which differ; expected one image of each place");
    test::DicomSeries magnetic;
    magnetic.modality = "MR";
    test::write_dicom(folder / "mr", ct, magnetic);
    test::expect_said(refused(folder / "mr"), "no slices of CT were found in 6 DICOM files");
}

TEST_F(CtFile, Jpeg2000AndEnhancedCtGiveBackPlacesAndValues) {
    const CtImage ct = small_ct();
    for (const bool jpeg2000 : {false, true})
        for (const bool enhanced : {false, true})
            for (const bool with_sign : {false, true}) {
                test::DicomSeries series;
                series.jpeg2000 = jpeg2000, series.enhanced = enhanced, series.with_sign = with_sign;
                const std::filesystem::path to =
                    folder / fmt::format("{}{}{}", jpeg2000, enhanced, with_sign);
                test::write_dicom(to, ct, series);
                SCOPED_TRACE(to);
                const CtImage read = read_ct(to);
                expect_same(read, ct, 1e-5);
                EXPECT_TRUE(read.notes.empty());
            }
}

TEST_F(CtFile, SlicesWhoseStepsAreRoundedOrChangeAreReadAndTheChangeIsTold) {
    CtImage ct = small_ct();
    ct.grid.size = {7, 5, 40};
    ct.grid.steps[2] *= 0.5;  // 0.625 mm
    ct.hu.clear();
    for (int k = 0; k < 40; ++k)
        for (int n = 0; n < 35; ++n) ct.hu.push_back(static_cast<std::int16_t>(-1000 + 40 * k + n));
    test::DicomSeries rounded;
    rounded.rounded = 0.1;
    test::write_dicom(folder / "rounded", ct, rounded);
    const CtImage taken = read_ct(folder / "rounded");
    EXPECT_EQ(taken.hu, ct.hu);
    EXPECT_LT((taken.grid.steps[2] - ct.grid.steps[2]).norm(), 0.01);
    ASSERT_EQ(taken.notes.size(), 1u);
    test::expect_said(taken.notes[0], "from equal steps of 0.62");

    // 4 mm and then 7 mm, with a short step between: values rise with the place, so that lines keep them.
    ct.grid.steps[2] = 4.0 * ct.grid.steps[2].normalized();
    test::DicomSeries changing;
    double at = 0;
    for (int k = 0; k < 40; ++k) {
        changing.at.push_back(at);
        for (int n = 0; n < 35; ++n)
            ct.hu[static_cast<std::size_t>(35 * k + n)] =
                static_cast<std::int16_t>(-1000 + std::lround(20 * at) + n);
        at += k < 20 ? 1 : k == 20 ? 0.27 : 1.75;
    }
    test::write_dicom(folder / "changing", ct, changing);
    const CtImage even = read_ct(folder / "changing");
    EXPECT_LT((even.grid.steps[2] - ct.grid.steps[2]).norm(), 1e-4);
    EXPECT_EQ(even.grid.size[2], static_cast<int>(changing.at.back()) + 1);
    for (int k = 0; k < even.grid.size[2]; ++k)
        EXPECT_NEAR(even.hu[even.grid.index(3, 2, k)], -1000 + 20 * k + 17, 1.1) << k;
    ASSERT_EQ(even.notes.size(), 1u);
    test::expect_said(even.notes[0], "slices are 1.08 to 7.00 mm apart; they were resampled to 4.00 mm");
}

TEST_F(CtFile, WhatIsNoCtOrTooLargeIsRefused) {
    test::expect_said(refused(folder / "nothing.nii"), "no such CT can be read");
    test::write(folder / "a.txt", "hello");
    test::expect_said(refused(folder / "a.txt"), "NIfTI (.nii, .nii.gz, .hdr with .img), NRRD");
    test::write(folder / "empty.nii", "");
    test::expect_said(refused(folder / "empty.nii"), "empty");
    test::expect_said(refused(folder.path()), "no slices of CT");
    CtImage labels = small_ct();
    for (std::int16_t& hu : labels.hu) hu = static_cast<std::int16_t>(std::abs(hu));
    write_ct(folder / "labels.nii", labels);
    test::expect_said(refused(folder / "labels.nii"), "Hounsfield units");
    test::expect_said(refused(folder / "labels.nii", "4"), "expected 'series' only with a folder");
    CtImage coarse = small_ct();
    coarse.grid.steps[2] *= 10;
    write_ct(folder / "coarse.nrrd", coarse);
    test::expect_said(refused(folder / "coarse.nrrd"), "12.5 mm apart along axis 3");
    // A header of a gigabyte is refused before memory is taken for it.
    write_ct(folder / "huge.nii", small_ct());
    std::string text = test::read(folder / "huge.nii");
    const short size[3] = {1000, 1000, 500};
    std::memcpy(text.data() + offsetof(nifti_1_header, dim) + 2, size, sizeof size);
    test::write(folder / "huge.nii", text);
    test::expect_said(refused(folder / "huge.nii"), "asks for 1000000000 bytes");
}

TEST_F(CtFile, OneSubfolderThatCannotBeReadNamesItself) {
    const std::filesystem::path whole = folder / "whole";
    test::write_dicom(whole / "a", small_ct());
    std::filesystem::create_symlink("nothing", whole / "to_nothing");
    std::filesystem::create_directory_symlink(whole, whole / "to_all");
    const auto read_whole = read_ct(whole);
    expect_same(read_whole, small_ct(), 1e-5);
    test::expect_said(fmt::format("{}", fmt::join(read_whole.notes, "\n")),
                      "a link of the folder leads to nothing, to_nothing");
    std::filesystem::create_symlink("itself", whole / "a/itself");
    const auto hashed = [&] { return test::refusal([&] { content_hash(whole); }); };
    for (const std::string& said : {refused(whole), hashed()}) {
        test::expect_said(said, "whole/a/itself: ");
        test::expect_said(said, "Too many levels of symbolic links");
    }
    std::filesystem::remove(whole / "a/itself");
    if (::geteuid() == 0) {  // whom nothing is closed to
        std::filesystem::permissions(folder.path(), std::filesystem::perms::all);
        ASSERT_EQ(::seteuid(65534), 0);
    }
    std::filesystem::path closed = folder / "closed";
    test::write_dicom(closed, small_ct());
    std::filesystem::create_directory(closed / "locked");
    std::filesystem::permissions(closed / "locked", std::filesystem::perms::none);
    const std::string read = refused(closed), hash = test::refusal([&] { content_hash(closed); });
    std::filesystem::permissions(closed / "locked", std::filesystem::perms::all);
    if (::getuid() == 0) {
        ASSERT_EQ(::seteuid(0), 0);
    }
    for (const std::string& said : {read, hash}) {
        test::expect_said(said, "closed/locked: ");
        test::expect_said(said, "Permission denied");
    }
}

TEST_F(CtFile, AFolderOfTooManyFilesIsRefusedBeforeAnyIsOpened) {
    std::filesystem::create_directory(folder / "many");
    for (int k = 0; k <= 20'000; ++k) test::write(folder / fmt::format("many/{}.dcm", k), "");
    const std::string hashed = test::refusal([&] { content_hash(folder / "many"); });
    for (const std::string& said : {refused(folder / "many"), hashed})
        test::expect_said(said,
                          "many: more than 20000 files were found; expected the folder of one examination");
}

TEST_F(CtFile, DamagedFilesAreReadOrRefused) {
    const io::WithoutWall here;
    const CtImage ct = small_ct();
    write_ct(folder / "a.nii", ct);
    write_ct(folder / "a.nii.gz", ct);
    write_ct(folder / "a.nrrd", ct);
    test::write(
        folder / "b.nrrd",
        "NRRD0004\ntype: float\ndimension: 3\nspace: RAS\nsizes: 2 2 2\nspace directions: (1,0,0) (0,1,0) "
        "(0,0,1)\nspace origin: (0,0,0)\nencoding: ascii\n\n-1000 0 1 2 3 4 5 6\n");
    std::string numbers =
        "NRRD0004\ntype: float\ndimension: 3\nspace: RAS\nsizes: 7 5 6\nspace directions: "
        "(1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nendian: little\nencoding: raw\n\n";
    for (const std::int16_t hu : ct.hu) {
        const auto f = static_cast<float>(hu);
        numbers.append(reinterpret_cast<const char*>(&f), sizeof f);
    }
    test::write(folder / "c.nrrd", numbers);
    test::write_dicom(folder / "d", ct);
    const std::filesystem::path one = std::filesystem::path(folder / "d") / "IM0003";

    const unsigned seed = 20260709;
    std::mt19937 random(seed);
    int read = 0, refusals = 0;
    const auto damage = [&](const std::filesystem::path& file, const std::filesystem::path& asked,
                            int times) {
        const std::string whole = test::read(file);
        for (int t = 0; t < times; ++t) {
            std::string text = whole;
            const int kind = static_cast<int>(random() % 4);
            // Headers are where it hurts.
            const std::size_t reach =
                random() % 3 == 0 ? text.size() : std::min<std::size_t>(text.size(), 600);
            for (int n = static_cast<int>(random() % 6) + 1; n > 0; --n) {
                const std::size_t at = random() % reach;
                if (kind == 0) text[at] = static_cast<char>(random());
                if (kind == 1) text[at] = static_cast<char>(text[at] ^ (1 << (random() % 8)));
                if (kind == 2)
                    std::memset(text.data() + at, static_cast<int>(random() % 2 * 255),
                                std::min<std::size_t>(4, text.size() - at));
                if (kind == 3) std::swap(text[at], text[random() % reach]);
            }
            if (random() % 8 == 0) text.resize(random() % text.size());
            overwrite(file, text);
            try {
                const CtImage image = read_ct(asked);
                ++read;
                ASSERT_EQ(image.hu.size(), image.grid.count());
                ASSERT_TRUE(image.grid.axes().allFinite() && image.grid.origin.allFinite());
                for (const std::int16_t hu : image.hu) ASSERT_TRUE(hu >= lowest_hu && hu <= highest_hu);
            } catch (const io::InputError&) {
                ++refusals;
            } catch (const std::exception& error) {
                FAIL() << file << ", seed " << seed << ", try " << t << ": " << error.what();
            }
        }
        overwrite(file, whole);
    };
    test::write(
        folder / "hex.nrrd",
        "NRRD0004\ntype: short\ndimension: 3\nspace: RAS\nsizes: 2 2 2\nspace directions: (1,0,0) (0,1,0) "
        "(0,0,1)\n"
        "space origin: (0,0,0)\nendian: little\nencoding: hex\n\n18fc00000100020003000400050006\n00\n");
    test::write(folder / "p1.raw", std::string("\x18\xfc\0\0\0\0\0\0", 8));
    test::write(folder / "p2.raw", std::string(8, '\1'));
    test::write(folder / "p.nhdr",
                "NRRD0004\ntype: short\ndimension: 3\nspace: RAS\nsizes: 2 2 2\nspace directions: (1,0,0) "
                "(0,1,0) (0,0,1)\n"
                "space origin: (0,0,0)\nendian: little\nencoding: raw\ndata file: p%d.raw 1 2 1\n");
    test::write(
        folder / "m.mha",
        "NDims = 3\nDimSize = 2 2 2\nOffset = 0 0 0\nElementSpacing = 1 1 1\nElementType = MET_SHORT\n"
        "ElementDataFile = LOCAL\n" +
            std::string("\x18\xfc\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16));
    for (const char* name :
         {"a.nii", "a.nii.gz", "a.nrrd", "b.nrrd", "c.nrrd", "hex.nrrd", "p.nhdr", "m.mha"})
        damage(folder / name, folder / name, 2000);
    damage(one, folder / "d", 2000);
    EXPECT_GT(read, 500);
    EXPECT_GT(refusals, 2000);
}

}  // namespace patient
