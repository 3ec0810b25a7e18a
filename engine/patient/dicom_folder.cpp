#include <algorithm>
#include <array>
#include <cmath>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <dcmtk/oflog/oflog.h>
#include <fmt/format.h>
#include <map>

#include "engine/io/text.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/dicom_depth.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;

constexpr std::size_t most_files = 20000;

/// Decoders of compressed samples, and no reports on stderr: errors go where the others go.
struct Dcmtk {
    Dcmtk() {
        OFLog::configure(OFLogger::OFF_LOG_LEVEL);
        DcmRLEDecoderRegistration::registerCodecs();
        DJDecoderRegistration::registerCodecs();
        DJLSDecoderRegistration::registerCodecs();
    }
    ~Dcmtk() {
        DcmRLEDecoderRegistration::cleanup();
        DJDecoderRegistration::cleanup();
        DJLSDecoderRegistration::cleanup();
    }
};

/// One file of a series, without its samples.
struct Slice {
    fs::path file;
    std::string series, number, description;
    int columns = 0, rows = 0;
    Vec3 position, along_row, along_column;  // of the first sample; unit vectors
    double column_step = 0, row_step = 0;    // between columns, and between rows [mm]
    Rescale rescale;
};

bool has_dicom_mark(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    char mark[4] = {};
    return file.seekg(128) && file.read(mark, 4) && std::string_view(mark, 4) == "DICM";
}

std::string text_of(DcmDataset& data, const DcmTagKey& tag) {
    OFString value;
    data.findAndGetOFStringArray(tag, value);
    return std::string(value.c_str(), std::min<std::size_t>(value.size(), 120));
}

std::optional<double> number_of(DcmDataset& data, const DcmTagKey& tag, unsigned long index) {
    OFString value;
    if (data.findAndGetOFString(tag, value, index).bad()) return std::nullopt;
    std::string_view text(value.c_str(), value.size());
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ') || text.ends_with('\0')) text.remove_suffix(1);
    if (text.starts_with('+')) text.remove_prefix(1);
    const std::optional<double> number = io::parse_number(text);
    return number && std::isfinite(*number) ? number : std::nullopt;
}

template <std::size_t N>
std::array<double, N> numbers_of(const fs::path& path, DcmDataset& data, const DcmTagKey& tag,
                                 const char* name) {
    std::array<double, N> result;
    for (std::size_t i = 0; i < N; ++i) {
        const auto number = number_of(data, tag, i);
        if (!number)
            refuse_ct(path, fmt::format("'{}' was found for {}", text_of(data, tag), name),
                      fmt::format("expected {} finite numbers", N));
        result[i] = *number;
    }
    return result;
}

int whole_of(DcmDataset& data, const DcmTagKey& tag) {
    Uint16 value = 0;
    return data.findAndGetUint16(tag, value).good() ? value : -1;
}

/// The header of a file; empty for one that is no image of a CT, such as a report or a survey view.
std::optional<Slice> slice_of(const fs::path& path) {
    check_dicom_depth(path);
    DcmFileFormat file;
    constexpr Uint32 short_values = 4096;  // longer ones stay in the file: the samples
    if (const OFCondition read = file.loadFile(path.c_str(), EXS_Unknown, EGL_noChange, short_values);
        read.bad())
        refuse_ct(path, fmt::format("DCMTK cannot read it ({})", read.text()), "expected a whole DICOM file");
    DcmDataset& data = *file.getDataset();
    if (text_of(data, DCM_Modality) != "CT" || !data.tagExists(DCM_PixelData)) return std::nullopt;
    if (text_of(data, DCM_ImageType).find("LOCALIZER") != std::string::npos) return std::nullopt;
    // Pictures of the screen, such as dose reports, bear the scanner's modality.
    if (text_of(data, DCM_SOPClassUID).starts_with(UID_SecondaryCaptureImageStorage)) return std::nullopt;
    Slice slice;
    slice.file = path;
    slice.series = text_of(data, DCM_SeriesInstanceUID);
    slice.number = text_of(data, DCM_SeriesNumber);
    slice.description = text_of(data, DCM_SeriesDescription);
    if (slice.series.empty()) refuse_ct(path, "no SeriesInstanceUID was found", "one is needed");
    if (number_of(data, DCM_NumberOfFrames, 0).value_or(1) != 1)
        refuse_ct(path, "several frames in one file were found (enhanced CT)",
                  "expected a file for each slice; dcm2niix converts others to NIfTI");
    slice.rows = whole_of(data, DCM_Rows);
    slice.columns = whole_of(data, DCM_Columns);
    if (slice.rows < 2 || slice.columns < 2)
        refuse_ct(path, fmt::format("{} rows and {} columns were found", slice.rows, slice.columns),
                  "expected 2 or more of each");
    const int bits = whole_of(data, DCM_BitsAllocated), per_pixel = whole_of(data, DCM_SamplesPerPixel);
    if (bits != 16 || per_pixel != 1 || text_of(data, DCM_PhotometricInterpretation) != "MONOCHROME2")
        refuse_ct(path,
                  fmt::format("{} bits in {} values a sample, '{}', were found", bits, per_pixel,
                              text_of(data, DCM_PhotometricInterpretation)),
                  "expected 16 bits in one value, MONOCHROME2");
    const auto place = numbers_of<3>(path, data, DCM_ImagePositionPatient, "ImagePositionPatient");
    const auto turn = numbers_of<6>(path, data, DCM_ImageOrientationPatient, "ImageOrientationPatient");
    const auto spacing = numbers_of<2>(path, data, DCM_PixelSpacing, "PixelSpacing");
    slice.position = Vec3(place[0], place[1], place[2]);
    slice.along_row = Vec3(turn[0], turn[1], turn[2]);
    slice.along_column = Vec3(turn[3], turn[4], turn[5]);
    constexpr double slack = 1e-2;
    if (std::abs(slice.along_row.norm() - 1) > slack || std::abs(slice.along_column.norm() - 1) > slack ||
        std::abs(slice.along_row.dot(slice.along_column)) > slack)
        refuse_ct(
            path,
            fmt::format("ImageOrientationPatient '{}' was found", text_of(data, DCM_ImageOrientationPatient)),
            "expected two perpendicular unit vectors");
    slice.row_step = spacing[0];
    slice.column_step = spacing[1];
    if (!(slice.row_step > 0 && slice.column_step > 0))
        refuse_ct(path, fmt::format("PixelSpacing '{}' was found", text_of(data, DCM_PixelSpacing)),
                  "expected two numbers above 0");
    slice.rescale.slope = numbers_of<1>(path, data, DCM_RescaleSlope, "RescaleSlope")[0];
    slice.rescale.intercept = numbers_of<1>(path, data, DCM_RescaleIntercept, "RescaleIntercept")[0];
    return slice;
}

using Series = std::vector<Slice>;

std::string series_text(const Series& series) {
    const Slice& first = series.front();
    return fmt::format("number {}, '{}', {} slices of {} × {}, UID {}",
                       first.number.empty() ? "?" : first.number, first.description, series.size(),
                       first.columns, first.rows, first.series);
}

/// The series that is wanted, or the only one.
Series chosen(const fs::path& folder, std::map<std::string, Series> all, const std::string& wanted) {
    std::string listed;
    for (const auto& [uid, series] : all) listed += "\n  " + series_text(series);
    std::vector<const Series*> fitting;
    for (const auto& [uid, series] : all) {
        const Slice& first = series.front();
        if (wanted.empty() || uid == wanted || first.number == wanted || first.description == wanted)
            fitting.push_back(&series);
    }
    if (fitting.empty() && !wanted.empty()) {
        for (const auto& [uid, series] : all)
            if (series.front().description.starts_with(wanted)) fitting.push_back(&series);
    }
    if (fitting.size() == 1) return *fitting.front();
    if (wanted.empty())
        refuse_ct(folder, fmt::format("{} series of CT were found", all.size()),
                  "expected series = \"NUMBER, DESCRIPTION or UID\" of one of them:" + listed);
    refuse_ct(folder, fmt::format("{} series fit '{}'", fitting.size(), wanted),
              "expected the number, description or UID of one:" + listed);
}

/// Sorts the slices along their normal and finds the step from each to the next.
Vec3 sorted_step(const fs::path& folder, Series& series) {
    const Slice model = series.front();
    for (const Slice& slice : series) {
        constexpr double slack = 1e-3;
        if (slice.rows != model.rows || slice.columns != model.columns ||
            std::abs(slice.row_step - model.row_step) > slack ||
            std::abs(slice.column_step - model.column_step) > slack ||
            (slice.along_row - model.along_row).norm() > slack ||
            (slice.along_column - model.along_column).norm() > slack)
            refuse_ct(slice.file,
                      fmt::format("its size, spacing or orientation is not that of {}", model.file.string()),
                      "expected slices of one grid in a series");
    }
    if (series.size() < 2)
        refuse_ct(folder, fmt::format("one slice was found in the series {}", series_text(series)),
                  "expected two or more");
    const Vec3 normal = model.along_row.cross(model.along_column).normalized();
    std::ranges::sort(series, [&](const Slice& a, const Slice& b) {
        const double da = normal.dot(a.position), db = normal.dot(b.position);
        return da != db ? da < db : a.file < b.file;
    });
    // The usual step is the median one, so that a gap does not hide in the mean.
    std::vector<double> steps;
    for (std::size_t i = 1; i < series.size(); ++i)
        steps.push_back(normal.dot(series[i].position - series[i - 1].position));
    std::vector<double> ordered = steps;
    std::nth_element(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(ordered.size() / 2),
                     ordered.end());
    const double usual = ordered[ordered.size() / 2];
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const double slack = std::max(0.02, 0.02 * usual);  // positions are rounded to 0.01 mm or so
        if (std::abs(steps[i] - usual) <= slack) continue;
        const std::string where =
            fmt::format("{:.3f} mm lie between {} and {}, {:.3f} mm between most slices", steps[i],
                        series[i].file.filename().string(), series[i + 1].file.filename().string(), usual);
        refuse_ct(folder, (steps[i] > 1.5 * usual ? "a slice is missing: " : "") + where,
                  "expected slices equally far apart, each place once");
    }
    const Vec3 step =
        (series.back().position - series.front().position) / static_cast<double>(series.size() - 1);
    for (std::size_t i = 0; i < series.size(); ++i) {
        const double off =
            (series[i].position - series.front().position - static_cast<double>(i) * step).norm();
        constexpr double most = 0.25;  // a tilted gantry is a straight step; a wandering table is not [mm]
        if (off > most)
            refuse_ct(series[i].file,
                      fmt::format("its position is {:.2f} mm beside the line of the others", off),
                      fmt::format("expected at most {} mm", most));
    }
    return step;
}

void read_slice(const Slice& slice, std::int16_t* to) {
    check_dicom_depth(slice.file);  // it may have changed since
    DcmFileFormat file;
    if (const OFCondition read = file.loadFile(slice.file.c_str()); read.bad())
        refuse_ct(slice.file, fmt::format("DCMTK cannot read it ({})", read.text()),
                  "expected a whole DICOM file");
    DcmDataset& data = *file.getDataset();
    if (const OFCondition decoded = data.chooseRepresentation(EXS_LittleEndianExplicit, nullptr);
        decoded.bad())
        refuse_ct(
            slice.file,
            fmt::format("samples compressed as '{}' cannot be read ({})",
                        DcmXfer(data.getOriginalXfer()).getXferName(), decoded.text()),
            "expected uncompressed samples, RLE, JPEG or JPEG-LS; 'gdcmconv --raw' decompresses others");
    const Uint16* words = nullptr;
    unsigned long found = 0;
    const unsigned long needed =
        static_cast<unsigned long>(slice.rows) * static_cast<unsigned long>(slice.columns);
    if (data.findAndGetUint16Array(DCM_PixelData, words, &found).bad() || !words || found < needed)
        refuse_ct(slice.file, fmt::format("{} samples were found", words ? found : 0),
                  fmt::format("expected {} × {}", slice.columns, slice.rows));
    const bool is_signed = whole_of(data, DCM_PixelRepresentation) == 1;
    int stored = whole_of(data, DCM_BitsStored);
    if (stored < 1 || stored > 16) stored = 16;
    const int unused = 16 - stored;  // bits above the highest, which may hold anything
    for (unsigned long i = 0; i < needed; ++i) {
        const auto shifted = static_cast<std::uint16_t>(words[i] << unused);
        const double value = is_signed ? static_cast<std::int16_t>(shifted) >> unused : shifted >> unused;
        const auto hu = as_hu(slice.rescale.slope * value + slice.rescale.intercept);
        if (!hu) refuse_ct(slice.file, "a value that is not finite was found", "expected finite values");
        to[i] = *hu;
    }
}

}  // namespace

CtImage read_dicom(const fs::path& folder, const std::string& wanted, const Progress& progress) {
    static const Dcmtk dcmtk;
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (!entry.is_regular_file() || !has_dicom_mark(entry.path())) continue;
        if (entry.path().filename() == "DICOMDIR") continue;
        files.push_back(entry.path());
        if (files.size() > most_files)
            refuse_ct(folder, fmt::format("more than {} DICOM files were found", most_files),
                      "expected the folder of one examination");
    }
    std::ranges::sort(files);
    std::map<std::string, Series> all;
    for (std::size_t i = 0; i < files.size(); ++i) {
        if (progress)
            progress(0.5 * static_cast<double>(i) / static_cast<double>(files.size()), "reading the CT");
        if (auto slice = slice_of(files[i])) all[slice->series].push_back(std::move(*slice));
    }
    if (all.empty())
        refuse_ct(folder, fmt::format("no slices of CT were found in {} DICOM files", files.size()),
                  "expected a folder of DICOM files");
    Series series = chosen(folder, std::move(all), wanted);
    const Vec3 step = sorted_step(folder, series);
    CtImage ct;
    const Slice& first = series.front();
    ct.grid.size = {first.columns, first.rows, static_cast<int>(series.size())};
    ct.grid.origin = first.position;
    ct.grid.steps = {first.column_step * first.along_row, first.row_step * first.along_column, step};
    require_usable(folder, ct.grid);
    // Compressed or not, a sample takes some room: no header asks for memory that its file does not fill.
    constexpr double largest_ratio = 1000;
    const double a_slice = 2.0 * first.rows * first.columns;
    for (const Slice& slice : series)
        if (a_slice > largest_ratio * static_cast<double>(fs::file_size(slice.file)))
            refuse_ct(slice.file,
                      fmt::format("its header asks for {} × {} samples, more than it can hold", first.columns,
                                  first.rows),
                      "expected a whole DICOM file");
    ct.hu.resize(ct.grid.count());
    for (std::size_t k = 0; k < series.size(); ++k) {
        if (progress)
            progress(0.5 + 0.5 * static_cast<double>(k) / static_cast<double>(series.size()),
                     "reading the CT");
        read_slice(series[k], ct.hu.data() + ct.grid.index(0, 0, static_cast<int>(k)));
    }
    return ct;
}

}  // namespace patient
