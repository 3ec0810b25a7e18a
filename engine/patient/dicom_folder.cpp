#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <numbers>

#include "engine/io/files.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/dicom_file.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;

using Series = std::vector<DicomSlice>;

/// A file as the folder names it.
std::string name_in(const fs::path& folder, const DicomSlice& slice) {
    return slice.file.lexically_relative(folder).string();
}

std::string series_text(const Series& series) {
    const DicomSlice& first = series.front();
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
        const DicomSlice& first = series.front();
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

void require_one_grid(const fs::path& folder, const Series& series) {
    const DicomSlice& model = series.front();
    for (const DicomSlice& slice : series) {
        constexpr double slack = 1e-3;
        if (slice.rows != model.rows || slice.columns != model.columns ||
            std::abs(slice.row_step - model.row_step) > slack ||
            std::abs(slice.column_step - model.column_step) > slack ||
            (slice.along_row - model.along_row).norm() > slack ||
            (slice.along_column - model.along_column).norm() > slack ||
            slice.frame_of_reference != model.frame_of_reference)
            refuse_ct(slice.file,
                      fmt::format("its {} is not that of {}",
                                  slice.frame_of_reference != model.frame_of_reference
                                      ? "frame of reference"
                                      : "size, spacing or orientation",
                                  name_in(folder, model)),
                      "expected slices of one grid in a series");
    }
}

bool same_bytes(const fs::path& a, const fs::path& b) {
    std::error_code failed;
    return fs::file_size(a, failed) == fs::file_size(b, failed) && !failed &&
           io::read_text(a, "DICOM file", "expected a whole file") ==
               io::read_text(b, "DICOM file", "expected a whole file");
}

/// Sorts the slices along their normal, and leaves out copies of files; returns how many.
int sort_slices(Series& series) {
    const Vec3 normal = series.front().along_row.cross(series.front().along_column).normalized();
    std::ranges::sort(series, [&](const DicomSlice& a, const DicomSlice& b) {
        const double da = normal.dot(a.position), db = normal.dot(b.position);
        return da != db ? da < db : a.file != b.file ? a.file < b.file : a.frame < b.frame;
    });
    const auto is_copy = [](const DicomSlice& a, const DicomSlice& b) {
        return a.uid == b.uid && a.frame == b.frame && a.position == b.position && a.file != b.file &&
               same_bytes(a.file, b.file);
    };
    const auto end = std::unique(series.begin(), series.end(), is_copy);
    const auto copies = static_cast<int>(series.end() - end);
    series.erase(end, series.end());
    return copies;
}

/// Where a series of sorted slices lies along its line.
struct Line {
    Vec3 step;                      // from each slice to the next, where steps are equal
    std::vector<double> places;     // of slices, from the first in units of that step
    std::vector<double> steps;      // from each slice to the next [mm]
    double largest = 0, least = 0;  // of them
    double usual = 0, median = 0;   // a quarter, and half, of them are no longer than these
    double off = 0;                 // largest deviation from equal steps [mm]
};

Line line_of(const fs::path& folder, const Series& series) {
    const std::size_t last = series.size() - 1;
    const Vec3 way = series.back().position - series.front().position;
    const Vec3 normal = series.front().along_row.cross(series.front().along_column).normalized();
    Line line;
    line.step = way / static_cast<double>(last);
    const double step = line.step.norm(), rise = normal.dot(way);
    constexpr double most_tilt = 40 * std::numbers::pi / 180;
    if (rise > 0 && std::acos(std::min(1.0, rise / way.norm())) > most_tilt)
        refuse_ct(folder,
                  fmt::format("its slices follow one another {:.0f}° from their normal",
                              std::acos(std::min(1.0, rise / way.norm())) * 180 / std::numbers::pi),
                  "expected at most 40°, as of a tilted gantry");
    for (std::size_t i = 0; i <= last; ++i) {
        const Vec3 from_first = series[i].position - series.front().position;
        const double part = rise > 0 ? normal.dot(from_first) / rise : 0;
        // A tilted gantry is a straight line; a wandering table is not.
        constexpr double most_beside = 0.25;  // [mm]
        if (const double beside = (from_first - part * way).norm(); beside > most_beside)
            refuse_ct(series[i].file,
                      fmt::format("its position is {:.2f} mm beside the line of the others", beside),
                      fmt::format("expected at most {} mm", most_beside));
        line.places.push_back(part * static_cast<double>(last));
        line.off = std::max(line.off, std::abs(line.places[i] - static_cast<double>(i)) * step);
        if (i > 0) line.steps.push_back((line.places[i] - line.places[i - 1]) * step);
    }
    std::vector<double> ordered = line.steps;
    std::ranges::sort(ordered);
    line.least = ordered.front(), line.largest = ordered.back();
    line.usual = ordered[ordered.size() / 4], line.median = ordered[ordered.size() / 2];
    // Two images of one place are two of something: phases of a heart, or reconstructions.
    constexpr double least_step = 0.02;  // [mm]
    for (std::size_t i = 0; i < last; ++i)
        if (line.steps[i] < least_step)
            refuse_ct(folder,
                      fmt::format("{:.3f} mm lie between {} and {}, which differ", line.steps[i],
                                  name_in(folder, series[i]), name_in(folder, series[i + 1])),
                      "expected one image of each place: one phase, one reconstruction");
    return line;
}

/// Refuses a series of equal steps from which slices are missing: what lies there is not known.
void require_no_gap(const fs::path& folder, const Series& series, const Line& line) {
    const double median = line.median;
    const std::vector<double>& steps = line.steps;
    const double slack = std::max(0.12, 0.02 * median);  // positions may be rounded to 0.1 mm
    std::size_t gap = 0;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const double times = std::round(steps[i] / median);
        if (times < 1 || std::abs(steps[i] - times * median) > slack) return;  // steps that change
        if (times == 1) continue;
        if (i > 0 && steps[i - 1] > 1.5 * median) return;  // several long ones in a row: they change, too
        if (gap == 0) gap = i + 1;
    }
    if (gap == 0) return;
    refuse_ct(
        folder,
        fmt::format("a slice is missing: {:.3f} mm lie between {} and {}, {:.3f} mm between most slices",
                    steps[gap - 1], name_in(folder, series[gap - 1]), name_in(folder, series[gap]), median),
        "expected a whole series");
}

/// Samples at equal steps, by straight lines between slices.
void resample(CtImage& ct, const Line& line, double step) {
    const double length = line.step.norm();
    const double last = line.places.back() * length;
    const auto layers = static_cast<int>(std::floor(last / step + 1e-6)) + 1;
    CtImage even;
    even.grid = ct.grid;
    even.grid.size[2] = layers;
    even.grid.steps[2] = step / length * line.step;
    even.hu.resize(even.grid.count());
    const std::size_t layer =
        static_cast<std::size_t>(ct.grid.size[0]) * static_cast<std::size_t>(ct.grid.size[1]);
    std::size_t below = 0;
    for (int k = 0; k < layers; ++k) {
        const double at = std::min(k * step / length, line.places.back());
        while (below + 2 < line.places.size() && line.places[below + 1] <= at) ++below;
        const double part = (at - line.places[below]) / (line.places[below + 1] - line.places[below]);
        const std::int16_t *a = ct.hu.data() + below * layer, *b = a + layer;
        std::int16_t* const to = even.hu.data() + static_cast<std::size_t>(k) * layer;
        for (std::size_t i = 0; i < layer; ++i)
            to[i] = static_cast<std::int16_t>(std::lround((1 - part) * a[i] + part * b[i]));
    }
    ct.grid = even.grid;
    ct.hu = std::move(even.hu);
}

/// All slices, each file read once.
void read_all(const Series& series, CtImage& ct, const Progress& progress) {
    SampleFindings findings;
    std::map<fs::path, std::vector<int>> by_file;
    for (std::size_t k = 0; k < series.size(); ++k) by_file[series[k].file].push_back(static_cast<int>(k));
    std::size_t done = 0;
    for (const auto& [file, layers] : by_file) {
        if (progress)
            progress(0.5 + 0.5 * static_cast<double>(done) / static_cast<double>(series.size()),
                     "reading the CT");
        std::vector<const DicomSlice*> slices;
        std::vector<std::int16_t*> to;
        for (const int k : layers) {
            slices.push_back(&series[static_cast<std::size_t>(k)]);
            to.push_back(ct.hu.data() + ct.grid.index(0, 0, k));
        }
        read_dicom_slices(slices, to, findings);
        done += layers.size();
    }
    findings.tell(ct);
}

}  // namespace

CtImage read_dicom(const fs::path& folder, const std::string& wanted, const Progress& progress) {
    std::vector<fs::path> files, links_to_nothing;
    int empty = 0;
    for (fs::path& file : files_below(folder, &links_to_nothing)) {
        std::error_code failed;
        empty += fs::file_size(file, failed) == 0;
        if (is_dicom_file(file) && file.filename() != "DICOMDIR") files.push_back(std::move(file));
    }
    std::map<std::string, Series> all;
    for (std::size_t i = 0; i < files.size(); ++i) {
        if (progress)
            progress(0.5 * static_cast<double>(i) / static_cast<double>(files.size()), "reading the CT");
        for (DicomSlice& slice : dicom_slices(files[i])) all[slice.series].push_back(std::move(slice));
    }
    if (all.empty())
        refuse_ct(folder, fmt::format("no slices of CT were found in {} DICOM files", files.size()),
                  "expected a folder of DICOM files");
    Series series = chosen(folder, std::move(all), wanted);
    CtImage ct;
    require_one_grid(folder, series);
    if (empty > 0)
        ct.notes.push_back(fmt::format("{} in the folder {} empty: slices may be missing at an end",
                                       empty == 1 ? "a file" : fmt::format("{} files", empty),
                                       empty == 1 ? "is" : "are"));
    if (const std::size_t links = links_to_nothing.size(); links > 0)
        ct.notes.push_back(fmt::format("{} of the folder {} to nothing, {}: slices may be missing at an end",
                                       links == 1 ? "a link" : fmt::format("{} links", links),
                                       links == 1 ? "leads" : "lead",
                                       links_to_nothing.front().lexically_relative(folder).string()));
    if (const int copies = sort_slices(series); copies > 0)
        ct.notes.push_back(fmt::format("{} {} left out: copies of other files", copies,
                                       copies == 1 ? "slice was" : "slices were"));
    if (series.size() < 2)
        refuse_ct(folder, fmt::format("one slice was found in the series {}", series_text(series)),
                  "expected two or more");
    const Line line = line_of(folder, series);
    const DicomSlice& first = series.front();
    ct.frame_of_reference = first.frame_of_reference;
    ct.grid.size = {first.columns, first.rows, static_cast<int>(series.size())};
    ct.grid.origin = first.position;
    ct.grid.steps = {first.column_step * first.along_row, first.row_step * first.along_column, line.step};
    require_usable(folder, ct.grid);
    const double mean = line.step.norm();
    constexpr double rounded = 0.11, told = 0.02;  // positions to 0.1 mm; and what is not worth a word [mm]
    const bool even = line.off <= rounded && line.largest < 1.5 * mean;
    constexpr double longest = 10;  // [mm]
    if (!even) {
        require_no_gap(folder, series, line);
        if (line.largest > longest)
            refuse_ct(folder, fmt::format("slices {:.2f} mm apart were found", line.largest),
                      fmt::format("expected at most {:g} mm", longest));
        render::VolumeGrid finer = ct.grid;
        finer.steps[2] *= line.usual / mean;
        finer.size[2] = static_cast<int>(std::min(32768.0, line.places.back() * mean / line.usual)) + 1;
        require_usable(folder, finer);
    }
    ct.hu.resize(ct.grid.count());
    read_all(series, ct, progress);
    if (!even) {
        resample(ct, line, line.usual);
        ct.notes.push_back(
            fmt::format("slices are {:.2f} to {:.2f} mm apart; they were resampled to {:.2f} mm, by straight "
                        "lines between slices",
                        line.least, line.largest, line.usual));
    } else if (line.off > told) {
        ct.notes.push_back(
            fmt::format("slices deviate by up to {:.2f} mm from equal steps of {:.3f} mm, as rounded "
                        "positions do; the steps were taken as equal",
                        line.off, mean));
    }
    return ct;
}

}  // namespace patient
