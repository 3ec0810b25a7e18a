/// Segmentations of DICOM (SEG): a frame for each slice of each segment, or of all in a label map. Slices in
/// which nothing is marked may be left out, and frames come in any order.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>

#include "engine/patient/ct_samples.h"
#include "engine/patient/dicom_data.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;

constexpr int most_frames = 200'000, most_segments = 32'767;
constexpr std::size_t most_inflated_seg = std::size_t{512} << 20;  // [bytes]
constexpr const char* accepted = "expected a DICOM segmentation (SEG)";

enum class Kind { Binary, Fractional, LabelMap };

struct Frame {
    int number = 0;    // in the file
    int segment = 0;   // 0 = of all
    double along = 0;  // the normal [mm]
    DicomPlane plane;
};

struct SegFile {
    fs::path path;
    Kind kind = Kind::Binary;
    int columns = 0, rows = 0, bits = 0, largest = 1;
    int background = 0;  // of a label map, besides 0
    std::vector<Frame> frames;

    std::size_t samples() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
};

Kind kind_of(const fs::path& path, DcmDataset& data) {
    const std::string sop = text_of(data, DCM_SOPClassUID), modality = text_of(data, DCM_Modality);
    constexpr const char* label_map = "1.2.840.10008.5.1.4.1.1.66.7";
    if (sop != UID_SegmentationStorage && sop != label_map)
        refuse_ct(path,
                  fmt::format("a DICOM file of modality '{}', '{}', was found", modality,
                              dcmFindNameOfUID(sop.c_str(), sop.c_str())),
                  std::string(accepted) + (modality == "RTSTRUCT"
                                               ? ": a program such as 3D Slicer makes one of contours"
                                           : modality == "CT" ? "; a CT goes to --ct"
                                                              : ""));
    const std::string kind = text_of(data, DCM_SegmentationType);
    if (kind == "BINARY") return Kind::Binary;
    if (kind == "FRACTIONAL") return Kind::Fractional;
    if (kind == "LABELMAP") return Kind::LabelMap;
    refuse_ct(path, fmt::format("'{}' was found for SegmentationType", kind),
              "expected BINARY, FRACTIONAL or LABELMAP");
}

SegFile header_of(const fs::path& path, DcmDataset& data) {
    SegFile file;
    file.path = path;
    file.kind = kind_of(path, data);
    file.rows = whole_of(data, DCM_Rows);
    file.columns = whole_of(data, DCM_Columns);
    file.bits = whole_of(data, DCM_BitsAllocated);
    if (file.rows < 2 || file.columns < 2)
        refuse_ct(path, fmt::format("{} rows and {} columns were found", file.rows, file.columns),
                  "expected 2 or more of each");
    const bool fits = file.kind == Kind::Binary       ? file.bits == 1 || file.bits == 8
                      : file.kind == Kind::Fractional ? file.bits == 8
                                                      : file.bits == 8 || file.bits == 16;
    if (const int per_pixel = whole_of(data, DCM_SamplesPerPixel); !fits || per_pixel != 1)
        refuse_ct(path, fmt::format("{} bits in {} values a sample were found", file.bits, per_pixel),
                  "expected one value: 1 bit (BINARY), 8 (FRACTIONAL), 8 or 16 (LABELMAP)");
    if (file.kind == Kind::Fractional) {
        file.largest = whole_of(data, DCM_MaximumFractionalValue);
        if (file.largest < 1 || file.largest > 255)
            refuse_ct(path, fmt::format("{} was found for MaximumFractionalValue", file.largest),
                      "expected 1 to 255");
    }
    if (file.kind == Kind::LabelMap)
        file.background = static_cast<int>(number_of(data, DCM_PixelPaddingValue, 0).value_or(0));
    const std::vector<FrameGroups> groups = groups_of_frames(data);
    const double frames = number_of(data, DCM_NumberOfFrames, 0).value_or(0);
    if (!(frames >= 1 && frames <= most_frames) || frames != static_cast<double>(groups.size()))
        refuse_ct(path, fmt::format("{:g} frames and the places of {} were found", frames, groups.size()),
                  fmt::format("expected up to {} frames and the place of each", most_frames));
    for (const FrameGroups& group : groups) {
        Frame frame;
        frame.number = static_cast<int>(file.frames.size());
        frame.plane = plane_of(path, data, group);
        if (file.kind != Kind::LabelMap) {
            DcmItem& item =
                group.item_with(data, DCM_SegmentIdentificationSequence, DCM_ReferencedSegmentNumber);
            frame.segment = whole_of(item, DCM_ReferencedSegmentNumber);
            if (frame.segment < 1 || frame.segment > most_segments)
                refuse_ct(path, fmt::format("frame {} has the segment {}", frame.number + 1, frame.segment),
                          fmt::format("expected a number from 1 to {}", most_segments));
        }
        file.frames.push_back(frame);
    }
    // A header asks for no memory that its file does not fill; frames in which little is marked pack well.
    constexpr double largest_ratio = 10'000;
    std::error_code failed;
    const auto size = static_cast<double>(fs::file_size(path, failed));
    const double stored = frames * static_cast<double>(file.samples()) * file.bits / 8;
    if (failed || stored > largest_ratio * size || stored > 4e9)
        refuse_ct(path,
                  fmt::format("its header asks for {:g} frames of {} × {} samples", frames, file.columns,
                              file.rows),
                  "expected as many as the file can hold, up to 4 GB");
    return file;
}

std::vector<LabelImage::Name> names_of(DcmDataset& data) {
    std::vector<LabelImage::Name> names;
    DcmSequenceOfItems* segments = nullptr;
    if (data.findAndGetSequence(DCM_SegmentSequence, segments).bad() || !segments) return names;
    for (DcmObject* object = segments->nextInContainer(nullptr); object;
         object = segments->nextInContainer(object)) {
        auto* const item = dynamic_cast<DcmItem*>(object);
        if (!item) continue;
        std::string name = text_of(*item, DCM_SegmentLabel);
        DcmItem* code = nullptr;
        if (name.empty() &&
            item->findAndGetSequenceItem(DCM_SegmentedPropertyTypeCodeSequence, code).good() && code)
            name = text_of(*code, DCM_CodeMeaning);
        if (const int number = whole_of(*item, DCM_SegmentNumber); number > 0 && !name.empty())
            names.push_back({number, 0, name});
    }
    std::ranges::stable_sort(names, {}, &LabelImage::Name::value);
    return names;
}

/// Steps of equal slices of which some are left out; `along` ascends. 0 where they are not equal.
double step_of(const std::vector<double>& along, double near) {
    constexpr double rounded = 0.12;  // positions to 0.1 mm
    double sum = 0, fewest = 0;
    for (std::size_t i = 1; i < along.size(); ++i)
        if (const double by = along[i] - along[i - 1]; by <= near + rounded) sum += by, ++fewest;
    const double guess = fewest > 0 ? sum / fewest : near;
    double count = 0;
    for (std::size_t i = 1; i < along.size(); ++i) count += std::round((along[i] - along[i - 1]) / guess);
    const double step = (along.back() - along.front()) / count;
    for (const double at : along) {
        const double places = (at - along.front()) / step;
        if (std::abs(places - std::round(places)) * step > std::min(rounded, 0.25 * step)) return 0;
    }
    return step;
}

/// The slices of all frames, and in `layer` which of them each frame is.
render::VolumeGrid grid_of(SegFile& file, DcmDataset& data, std::vector<int>& layer, LabelImage& labels) {
    const DicomPlane model = file.frames.front().plane;
    const Vec3 normal = model.normal();
    for (Frame& frame : file.frames) {
        constexpr double slack = 1e-3;
        const DicomPlane& plane = frame.plane;
        if ((plane.along_row - model.along_row).norm() > slack ||
            (plane.along_column - model.along_column).norm() > slack ||
            std::abs(plane.row_step - model.row_step) > slack ||
            std::abs(plane.column_step - model.column_step) > slack)
            refuse_ct(file.path,
                      fmt::format("the spacing or orientation of frame {} is not that of frame 1",
                                  frame.number + 1),
                      "expected frames of one grid");
        frame.along = normal.dot(plane.position - model.position);
    }
    const auto [first, last] = std::ranges::minmax_element(file.frames, {}, &Frame::along);
    const Vec3 origin = first->plane.position, way = last->plane.position - origin;
    const double start = first->along, length = last->along - start;
    std::vector<double> along;
    for (const Frame& frame : file.frames) {
        // A tilted gantry's slices lie on a straight line that is not their normal.
        constexpr double most_beside = 0.25;  // [mm]
        const Vec3 on_line = length > 0 ? Vec3((frame.along - start) / length * way) : Vec3::Zero();
        if (const double beside = (frame.plane.position - origin - on_line).norm(); beside > most_beside)
            refuse_ct(file.path,
                      fmt::format("frame {} lies {:.2f} mm beside the line of the others", frame.number + 1,
                                  beside),
                      fmt::format("expected at most {} mm", most_beside));
        along.push_back(frame.along - start);
    }
    std::ranges::sort(along);
    constexpr double same = 0.02;  // [mm]
    along.erase(std::unique(along.begin(), along.end(), [](double a, double b) { return b - a < same; }),
                along.end());
    FrameGroups groups = groups_of_frames(data).front();
    const auto stated = [&](const DcmTagKey& tag) {
        const double number =
            number_of(groups.item_with(data, DCM_PixelMeasuresSequence, tag), tag, 0).value_or(0);
        return number > 0 ? number : 0.0;
    };
    const double spacing = stated(DCM_SpacingBetweenSlices);
    double step = 0;
    if (along.size() < 2) {
        step = spacing > 0 ? spacing : stated(DCM_SliceThickness);
    } else {
        double least = length;
        for (std::size_t i = 1; i < along.size(); ++i) least = std::min(least, along[i] - along[i - 1]);
        if (spacing > 0) step = step_of(along, spacing);
        if (step == 0) step = step_of(along, least);
        if (step == 0)
            refuse_ct(file.path,
                      fmt::format("its slices lie {:.3f} mm apart and more, in no equal steps", least),
                      "expected equal steps, with slices left out or not: save the mask on an even grid");
        if (spacing > 0 && std::abs(spacing - step) > 0.1 * step)
            labels.notes.push_back(fmt::format(
                "its slices lie {:.3g} mm apart, and its header says {:.3g}; the former was taken", step,
                spacing));
        else if (least > 1.5 * step)
            labels.notes.push_back(fmt::format(
                "its slices lie at least {:.3g} mm apart, and its header says {:.3g}; those between "
                "were taken as empty",
                least, spacing));
    }
    render::VolumeGrid grid;
    const double slices = step > 0 ? std::round(length / step) : 0;
    // One more at each end: a slice that is not there is empty.
    grid.size = {file.columns, file.rows, static_cast<int>(std::min(slices, 1e5)) + 3};
    const Vec3 between = slices > 0 ? Vec3(way / slices) : Vec3(step * normal);
    grid.origin = origin - between;
    grid.steps = {model.column_step * model.along_row, model.row_step * model.along_column, between};
    require_usable(file.path, grid);
    for (const Frame& frame : file.frames)
        layer.push_back(1 + (slices > 0 ? static_cast<int>(std::lround((frame.along - start) / step)) : 0));
    return grid;
}

/// What is marked in the frames.
class Marks {
public:
    Marks(const SegFile& file, DcmDataset& data) : file_(file) {
        if (file.bits != 1) {
            samples_.emplace(file.path, data, file.columns, file.rows);
            return;
        }
        unsigned long found = 0;
        if (data.findAndGetUint8Array(DCM_PixelData, bytes_, &found).bad() || !bytes_) found = 0;
        const std::size_t needed = (file.samples() * file.frames.size() + 7) / 8;
        if (found < needed)
            refuse_ct(
                file.path,
                fmt::format("{} bytes of samples were found, and its header asks for {}", found, needed),
                "expected a whole file, of bits that are not compressed");
    }

    /// Calls mark(sample, segment) for each, from the first row on.
    template <class Mark>
    void each(const Frame& frame, const Mark& mark) {
        const std::size_t count = file_.samples();
        if (bytes_) {
            const std::size_t begin = count * static_cast<std::size_t>(frame.number);
            for (std::size_t i = 0; i < count;) {
                const std::size_t bit = begin + i;
                if (bit % 8 == 0 && bytes_[bit / 8] == 0)
                    i += 8;
                else if (++i; bytes_[bit / 8] >> bit % 8 & 1)
                    mark(i - 1, frame.segment);
            }
            return;
        }
        const std::uint16_t* const words = samples_->of(frame.number);
        for (std::size_t i = 0; i < count; ++i) {
            const int value = words[i];
            if (value == 0) continue;
            fractions = fractions || (file_.kind == Kind::Fractional && value < file_.largest);
            if (file_.kind == Kind::LabelMap) {
                if (value != file_.background) mark(i, value);
            } else if (2 * value >= file_.largest)
                mark(i, frame.segment);
        }
    }

    bool fractions = false;

private:
    const SegFile& file_;
    const Uint8* bytes_ = nullptr;
    std::optional<StoredSamples> samples_;
};

/// Segments that overlap lie in layers. Whether any frame is empty.
bool fill(const SegFile& file, Marks& marks, const std::vector<int>& layer_of, LabelImage& labels,
          const Progress& progress) {
    const std::size_t count = labels.grid.count(), slice = file.samples();
    std::map<int, std::vector<const Frame*>> segments;
    for (const Frame& frame : file.frames) segments[frame.segment].push_back(&frame);
    std::vector<std::vector<std::int16_t>> layers;
    bool any_empty = false;
    std::size_t done = 0;
    for (const auto& [segment, frames] : segments) {
        const auto each = [&, &of_segment = frames](const auto& mark) {
            for (const Frame* const frame : of_segment) {
                const std::size_t from =
                    slice * static_cast<std::size_t>(layer_of[static_cast<std::size_t>(frame->number)]);
                bool empty = true;
                marks.each(*frame, [&](std::size_t i, int value) {
                    empty = false;
                    mark(from + i, value);
                });
                any_empty = any_empty || empty;
                if (progress)
                    progress(0.5 * static_cast<double>(++done) / static_cast<double>(file.frames.size()),
                             "reading the mask");
            }
        };
        std::vector<bool> free(layers.size(), true);
        each([&](std::size_t at, int) {
            for (std::size_t layer = 0; layer < layers.size(); ++layer)
                if (layers[layer][at] != 0) free[layer] = false;
        });
        const auto layer = static_cast<std::size_t>(std::ranges::find(free, true) - free.begin());
        if (layer == layers.size()) {
            if (static_cast<double>(count) * static_cast<double>(layer + 1) > most_samples)
                refuse_ct(file.path,
                          fmt::format("{} × {} × {} samples in {} layers of segments that overlap were found",
                                      file.columns, file.rows, labels.grid.size[2], layer + 1),
                          fmt::format("expected at most {:.0f} million", 1e-6 * most_samples));
            layers.emplace_back(count, std::int16_t{0});
        }
        each([&](std::size_t at, int value) {
            if (value > most_segments)
                refuse_ct(file.path, fmt::format("the segment {} was found", value),
                          fmt::format("expected numbers up to {}", most_segments));
            layers[layer][at] = static_cast<std::int16_t>(value);
        });
        for (LabelImage::Name& name : labels.names)
            if (name.value == segment) name.layer = static_cast<int>(layer);
    }
    labels.layers = static_cast<int>(layers.size());
    if (layers.size() == 1) {
        labels.values = std::move(layers[0]);
        return any_empty;
    }
    labels.values.resize(count * layers.size());
    for (std::size_t layer = 0; layer < layers.size(); ++layer)
        for (std::size_t n = 0; n < count; ++n) labels.values[n * layers.size() + layer] = layers[layer][n];
    return any_empty;
}

}  // namespace

LabelImage read_dicom_labels(const fs::path& path, const Progress& progress) {
    DcmFileFormat loaded;
    load_dicom(path, loaded, most_inflated_seg);
    DcmDataset& data = *loaded.getDataset();
    SegFile file = header_of(path, data);
    LabelImage labels;
    std::vector<int> layer_of;
    labels.grid = grid_of(file, data, layer_of, labels);
    labels.frame_of_reference = text_of(data, DCM_FrameOfReferenceUID);
    labels.names = names_of(data);
    std::map<std::pair<int, int>, int> frame_at;
    for (const Frame& frame : file.frames)
        if (const auto [other, is_new] = frame_at.insert(
                {{frame.segment, layer_of[static_cast<std::size_t>(frame.number)]}, frame.number});
            !is_new)
            refuse_ct(path,
                      fmt::format("frames {} and {} are of one slice{}", other->second + 1, frame.number + 1,
                                  frame.segment > 0 ? fmt::format(" of segment {}", frame.segment) : ""),
                      "expected one");
    Marks marks(file, data);
    labels.only_marked = !fill(file, marks, layer_of, labels, progress);
    if (marks.fractions)
        labels.notes.push_back(
            fmt::format("it has fractions: voxels from half of {} on are taken as marked", file.largest));
    // A program that writes empty slices, too, shows where the CT ends.
    if (!labels.only_marked && labels.grid.size[2] > 3) {
        const std::size_t slice = file.samples() * static_cast<std::size_t>(labels.layers);
        labels.values.erase(labels.values.begin(),
                            labels.values.begin() + static_cast<std::ptrdiff_t>(slice));
        labels.values.resize(labels.values.size() - slice);
        labels.grid.origin += labels.grid.steps[2];
        labels.grid.size[2] -= 2;
    }
    return labels;
}

}  // namespace patient
