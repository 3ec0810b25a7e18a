#include "engine/anatomy/import/mask_import.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <set>
#include <utility>

#include "engine/anatomy/import/mask_surface.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/patient/ct_image.h"
#include "engine/patient/vessel_fit.h"

namespace anatomy {
namespace {

using geometry::Mat3;
using geometry::Vec3;
using patient::LabelImage;
using render::VolumeGrid;

[[noreturn]] void refuse_mask(const std::filesystem::path& file, const std::string& what) {
    throw io::InputError(file.string() + ": " + what);
}

/// A structure of a file: a value of one of its layers.
using Label = std::pair<int, int>;  // layer, value

std::string text_of(const LabelImage& image, const Label& label) {
    for (const LabelImage::Name& name : image.names)
        if (name.layer == label.first && name.value == label.second)
            return fmt::format("{} '{}'", label.second, io::printable(name.name.substr(0, 60)));
    return image.layers > 1 ? fmt::format("{} in layer {}", label.second, label.first)
                            : std::to_string(label.second);
}

std::map<Label, std::size_t> counted(const LabelImage& image) {
    std::map<Label, std::size_t> counts;
    std::vector<std::vector<std::size_t>> table(static_cast<std::size_t>(image.layers),
                                                std::vector<std::size_t>(65536, 0));
    const auto layers = static_cast<std::size_t>(image.layers);
    for (std::size_t n = 0; n < image.values.size(); ++n)
        ++table[n % layers][static_cast<std::uint16_t>(image.values[n])];
    for (int layer = 0; layer < image.layers; ++layer)
        for (int v = -32768; v <= 32767; ++v)
            if (const std::size_t n = table[static_cast<std::size_t>(layer)][static_cast<std::uint16_t>(v)];
                n > 0 && v != 0)
                counts[{layer, v}] = n;
    return counts;
}

std::string list_of(const LabelImage& image, const std::map<Label, std::size_t>& counts) {
    std::string list;
    int listed = 0;
    for (const auto& [label, count] : counts)
        if (++listed <= 40)
            list += fmt::format("{}{} ({} voxels)", listed > 1 ? ", " : "", text_of(image, label), count);
    return listed > 40 ? list + fmt::format(" and {} more", listed - 40) : list;
}

/// Whether segments have the same number, as in layers.
bool numbers_repeat(const LabelImage& image) {
    std::set<int> numbers;
    return std::ranges::any_of(
        image.names, [&](const LabelImage::Name& name) { return !numbers.insert(name.value).second; });
}

/// The labels that the words name: by the file's names, else by number. Where several segments have one
/// number, as in layers, it counts the segments.
std::vector<Label> chosen_labels(const LabelImage& image, const std::filesystem::path& file,
                                 const std::vector<std::string>& words) {
    const std::map<Label, std::size_t> counts = counted(image);
    if (counts.empty())
        refuse_mask(file,
                    "the mask is empty: every voxel is 0; expected the voxels of a vessel marked in it");
    int least = 0, most = 0;
    for (const auto& [label, count] : counts) {
        least = std::min(least, label.second);
        most = std::max(most, label.second);
    }
    if (image.fractions && (least < 0 || most > 1))
        refuse_mask(
            file,
            fmt::format("values from {} to {} with fractions were found; expected a mask, 0 outside and 1 "
                        "in the vessel, or labels of whole numbers: save the segmentation, not the image",
                        least, most));
    if (least < 0 || counts.size() > 2000)
        refuse_mask(
            file,
            fmt::format("{} values from {} to {} were found; expected a mask or labels from 1 on: save the "
                        "segmentation, not the image",
                        counts.size(), least, most));
    if (words.empty()) {
        if (counts.size() == 1) return {counts.begin()->first};
        refuse_mask(
            file,
            fmt::format("{} labels were found; expected --label with the number or name of one or more of "
                        "them: {}",
                        counts.size(), list_of(image, counts)));
    }
    std::vector<Label> chosen;
    for (const std::string& word : words) {
        std::optional<Label> found;
        for (const LabelImage::Name& name : image.names) {
            if (io::lower_case(name.name) != io::lower_case(word) ||
                !counts.contains({name.layer, name.value}))
                continue;
            if (found)
                refuse_mask(file,
                            fmt::format("--label {}: several have this name; expected the number of one of "
                                        "them: {}",
                                        word, list_of(image, counts)));
            found = {name.layer, name.value};
        }
        if (const std::optional<int> number = io::parse_integer(word); number && !found) {
            std::vector<Label> by_number;
            for (const auto& [label, count] : counts)
                if (label.second == *number) by_number.push_back(label);
            if (by_number.size() == 1)
                found = by_number[0];
            else if (numbers_repeat(image) && *number >= 1 && *number <= static_cast<int>(image.names.size()))
                found = {image.names[static_cast<std::size_t>(*number) - 1].layer,
                         image.names[static_cast<std::size_t>(*number) - 1].value};
        }
        if (!found || !counts.contains(*found))
            refuse_mask(file, fmt::format("--label {}: there is no such label; expected one of these: {}",
                                          word, list_of(image, counts)));
        chosen.push_back(*found);
    }
    return chosen;
}

bool same_grid(const VolumeGrid& a, const VolumeGrid& b) {
    constexpr double near = 1e-2;  // [mm]
    if (a.size != b.size) return false;
    return (a.origin - b.origin).norm() < near &&
           (a.at(a.size[0], a.size[1], a.size[2]) - b.at(b.size[0], b.size[1], b.size[2])).norm() < near &&
           (a.at(a.size[0], 0, 0) - b.at(b.size[0], 0, 0)).norm() < near;
}

std::string grid_text(const VolumeGrid& grid) {
    return fmt::format("{} × {} × {} voxels of {:.3g} × {:.3g} × {:.3g} mm", grid.size[0], grid.size[1],
                       grid.size[2], grid.steps[0].norm(), grid.steps[1].norm(), grid.steps[2].norm());
}

/// Indices of a place in a grid, not rounded.
Vec3 index_of(const VolumeGrid& grid, const Mat3& inverse, const Vec3& place) {
    return inverse * (place - grid.origin);
}
bool holds(const VolumeGrid& grid, const Vec3& index) {
    for (int a = 0; a < 3; ++a)
        if (!(index[a] >= -0.5 && index[a] <= grid.size[a] - 0.5)) return false;
    return true;
}

/// Adds a mask of another grid, by the nearest voxels of the first.
void add_from(const VesselMask& from, VesselMask& to, const std::filesystem::path& file) {
    const Mat3 inverse = from.grid.axes().inverse(), own = to.grid.axes().inverse();
    Vec3 low = Vec3::Constant(1e9), high = -low;
    std::size_t outside = 0;
    for (int k = 0; k < from.grid.size[2]; ++k)
        for (int j = 0; j < from.grid.size[1]; ++j)
            for (int i = 0; i < from.grid.size[0]; ++i) {
                if (!from.inside[from.grid.index(i, j, k)]) continue;
                const Vec3 at = index_of(to.grid, own, from.grid.at(i, j, k));
                outside += !holds(to.grid, at);
                low = low.cwiseMin(at), high = high.cwiseMax(at);
            }
    if (outside > 0)
        refuse_mask(
            file,
            fmt::format("{} of its voxels lie outside the grid of the first mask; expected masks of one "
                        "CT: give the one with the largest grid first, or --ct",
                        outside));
    const auto range = [&](int a) {
        return std::pair(std::max(0, static_cast<int>(std::floor(low[a])) - 2),
                         std::min(to.grid.size[a] - 1, static_cast<int>(std::ceil(high[a])) + 2));
    };
    const auto [i0, i1] = range(0);
    const auto [j0, j1] = range(1);
    const auto [k0, k1] = range(2);
    for (int k = k0; k <= k1; ++k)
        for (int j = j0; j <= j1; ++j)
            for (int i = i0; i <= i1; ++i) {
                const Vec3 at = index_of(from.grid, inverse, to.grid.at(i, j, k));
                if (!holds(from.grid, at)) continue;
                const auto near = [&](int a) {
                    return std::clamp(static_cast<int>(std::lround(at[a])), 0, from.grid.size[a] - 1);
                };
                to.inside[to.grid.index(i, j, k)] |= from.inside[from.grid.index(near(0), near(1), near(2))];
            }
}

/// A mask of a file, with what the file says of its place.
struct PlacedMask {
    VesselMask mask;
    std::string frame_of_reference;
    bool only_marked = false;
};

PlacedMask read_mask(const std::filesystem::path& file, const std::vector<std::string>& words,
                     std::vector<Finding>& findings) {
    LabelImage image = patient::read_labels(file);
    const std::vector<Label> labels = chosen_labels(image, file, words);
    PlacedMask placed;
    placed.frame_of_reference = image.frame_of_reference;
    placed.only_marked = image.only_marked;
    VesselMask& mask = placed.mask;
    mask = {image.grid, std::vector<std::uint8_t>(image.grid.count(), 0)};
    const auto layers = static_cast<std::size_t>(image.layers);
    for (const auto& [layer, value] : labels)
        for (std::size_t n = 0; n < mask.inside.size(); ++n)
            mask.inside[n] |= image.values[n * layers + static_cast<std::size_t>(layer)] == value;
    std::string list;
    for (const Label& label : labels) list += (list.empty() ? "" : ", ") + text_of(image, label);
    findings.push_back({Finding::Kind::Noted, fmt::format("{}: label {}, {}", file.filename().string(), list,
                                                          grid_text(image.grid))});
    for (const std::string& note : image.notes)
        findings.push_back({Finding::Kind::Warned, fmt::format("{}: {}", file.filename().string(), note)});
    if (image.fractions)
        findings.push_back({Finding::Kind::Warned,
                            fmt::format("{} has fractions: voxels from 0.5 on are taken as the vessel",
                                        file.filename().string())});
    return placed;
}

/// Where the first voxel of one grid is in another, if all its voxels are voxels of that one or would be in a
/// larger one like it.
std::optional<std::array<int, 3>> place_in(const VolumeGrid& part, const VolumeGrid& whole) {
    // In a slice, and along the slices, whose positions may be rounded to 0.1 mm [voxels].
    constexpr std::array<double, 3> near = {0.02, 0.02, 0.25};
    const Mat3 inverse = whole.axes().inverse();
    std::array<int, 3> offset{};
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 at((corner & 1) * (part.size[0] - 1), (corner >> 1 & 1) * (part.size[1] - 1),
                      (corner >> 2) * (part.size[2] - 1));
        const Vec3 there = index_of(whole, inverse, part.at(at.x(), at.y(), at.z())) - at;
        for (int a = 0; a < 3; ++a) {
            if (!(std::abs(there[a]) < 1e6)) return std::nullopt;
            if (corner == 0) offset[a] = static_cast<int>(std::lround(there[a]));
            if (std::abs(there[a] - offset[a]) > near[a]) return std::nullopt;
        }
    }
    return offset;
}

/// Puts the voxels of a mask, at that place, into a grid with more or fewer empty slices; unless some are
/// outside it.
void move_into(const VolumeGrid& grid, const std::array<int, 3>& offset, VesselMask& mask) {
    VesselMask moved{grid, std::vector<std::uint8_t>(grid.count(), 0)};
    for (int k = 0; k < mask.grid.size[2]; ++k)
        for (int j = 0; j < mask.grid.size[1]; ++j)
            for (int i = 0; i < mask.grid.size[0]; ++i) {
                if (!mask.inside[mask.grid.index(i, j, k)]) continue;
                const std::array<int, 3> to = {i + offset[0], j + offset[1], k + offset[2]};
                for (int a = 0; a < 3; ++a)
                    if (to[a] < 0 || to[a] >= grid.size[a]) return;
                moved.inside[grid.index(to[0], to[1], to[2])] = 1;
            }
    mask = std::move(moved);
}

/// Refuses a mask whose coordinates are not those of the CT or of the first mask, by what their files say;
/// but takes one whose voxels are the other's.
void require_frame(const std::filesystem::path& file, const PlacedMask& placed,
                   const std::filesystem::path& other, const std::string& frame, const VolumeGrid& grid,
                   bool any_frame, std::vector<Finding>& findings) {
    const std::string& own = placed.frame_of_reference;
    if (own.empty() || frame.empty() || own == frame) return;
    const std::string differ =
        fmt::format("its frame of reference {} is not that of {}, {}", own, other.filename().string(), frame);
    if (any_frame || place_in(placed.mask.grid, grid))
        findings.push_back(
            {Finding::Kind::Warned,
             fmt::format("{}: {}; {}, so it is taken to lie there", file.filename().string(), differ,
                         any_frame ? "--any-frame was given" : "but the voxels are the same")});
    else
        refuse_mask(file,
                    differ +
                        "; expected a mask in the same coordinates: the CT that it was drawn in, or the "
                        "mask after registration; --any-frame takes it as it is");
}

/// The contrast that hangs together with the seed.
VesselMask grown_in(const patient::CtImage& ct, const MaskSource& source, std::vector<Finding>& findings) {
    constexpr double least_contrast = 120, tissue = 50;  // [HU]
    constexpr double most_volume = 1000;                 // [ml]
    const VolumeGrid& grid = ct.grid;
    const Vec3 at = index_of(grid, grid.axes().inverse(), *source.seed);
    if (!holds(grid, at))
        refuse_mask(
            source.ct,
            fmt::format("--from-ct {}: the place is outside the CT, which reaches from {} to {}; "
                        "expected a place in the contrast of a vessel [mm]",
                        io::place_text(*source.seed), io::place_text(grid.origin),
                        io::place_text(grid.at(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1))));
    std::array<int, 3> seed{};
    for (int a = 0; a < 3; ++a)
        seed[a] = std::clamp(static_cast<int>(std::lround(at[a])), 0, grid.size[a] - 1);
    double sum = 0;
    int count = 0;
    for (int n = 0; n < 27; ++n) {
        const std::array<int, 3> p = {seed[0] + n % 3 - 1, seed[1] + n / 3 % 3 - 1, seed[2] + n / 9 - 1};
        bool within = true;
        for (int a = 0; a < 3; ++a) within = within && p[a] >= 0 && p[a] < grid.size[a];
        if (within) sum += ct.hu[grid.index(p[0], p[1], p[2])], ++count;
    }
    const double mean = sum / count, threshold = source.threshold.value_or(std::round((mean + tissue) / 2));
    const bool filled = ct.hu[grid.index(seed[0], seed[1], seed[2])] >= threshold;
    if (!filled || (!source.threshold && mean < least_contrast))
        refuse_mask(
            source.ct,
            fmt::format("--from-ct {}: {:.0f} HU were found there; expected a place in the middle of a "
                        "vessel filled with contrast, {:.0f} HU or more, or a lower --threshold",
                        io::place_text(*source.seed), mean, source.threshold.value_or(least_contrast)));
    VesselMask mask{grid, std::vector<std::uint8_t>(grid.count(), 0)};
    const double voxel = std::abs(grid.axes().determinant()) / 1000;  // [ml]
    std::vector<std::array<std::int16_t, 3>> reached;
    const auto offer = [&](int i, int j, int k) {
        if (i < 0 || j < 0 || k < 0 || i >= grid.size[0] || j >= grid.size[1] || k >= grid.size[2]) return;
        const std::size_t n = grid.index(i, j, k);
        if (mask.inside[n] || ct.hu[n] < threshold) return;
        mask.inside[n] = 1;
        reached.push_back(
            {static_cast<std::int16_t>(i), static_cast<std::int16_t>(j), static_cast<std::int16_t>(k)});
    };
    offer(seed[0], seed[1], seed[2]);
    for (std::size_t next = 0; next < reached.size(); ++next) {
        const auto [i, j, k] = reached[next];
        if (voxel * static_cast<double>(reached.size()) > most_volume)
            refuse_mask(
                source.ct,
                fmt::format("--from-ct: more than {:.0f} ml hang together above {:.0f} HU, bone among them; "
                            "expected a vessel alone: a higher --threshold, or a mask from a "
                            "segmentation program",
                            most_volume, threshold));
        offer(i - 1, j, k), offer(i + 1, j, k), offer(i, j - 1, k);
        offer(i, j + 1, k), offer(i, j, k - 1), offer(i, j, k + 1);
    }
    findings.push_back(
        {Finding::Kind::Warned,
         fmt::format("approximate: the vessel is what hangs together with {} above {:.0f} HU ({:.0f} HU "
                     "there), {:.3g} ml; calcium counts as lumen, and bone that touches it too. A mask "
                     "made by hand is better",
                     io::place_text(*source.seed), threshold, mean,
                     voxel * static_cast<double>(reached.size()))});
    return mask;
}

}  // namespace

bool is_mask_file(const std::filesystem::path& file) {
    return patient::is_label_file(file);
}

std::string stem_of_mask(const std::filesystem::path& file) {
    std::string name = file.filename().string();
    for (const char* ending :
         {".nii.gz", ".nii", ".seg.nrrd", ".nrrd", ".nhdr", ".mha", ".mhd", ".seg.dcm", ".dcm"})
        if (io::lower_case(name).ends_with(ending))
            return name.substr(0, name.size() - std::string_view(ending).size());
    return file.stem().string();
}

std::vector<Finding> compare_with_ct(const geometry::TriangleMesh& mesh, const patient::CtImage& ct,
                                     const std::filesystem::path& file) {
    patient::PatientFiles files;
    files.ct = file;
    const std::string note = patient::require_fit(ct, mesh, files);
    if (note.empty()) return {};
    return {{Finding::Kind::Warned, note}};
}

ImportedLumen import_mask(const MaskSource& source, const ImportOptions& given) {
    if (!given.frame.axes.empty() || given.frame.scale != 1 || !given.frame.rotations.empty() ||
        (given.unit != "mm" && !given.unit.empty()))
        throw io::InputError(
            "a mask states its place and its unit in its header; expected no --unit, --scale, --axes and "
            "--rotate "
            "with one");
    std::vector<Finding> findings;
    patient::CtImage ct;
    std::optional<VolumeGrid> ct_grid;
    VesselMask mask;
    const auto report = [&](double part, const char* what) {
        if (given.progress) given.progress(part, what);
    };
    if (!source.ct.empty()) {
        ct = patient::read_ct(source.ct, source.series,
                              [&](double part, const char* what) { report(0.05 * part, what); });
        ct_grid = ct.grid;
        for (const std::string& note : ct.notes) findings.push_back({Finding::Kind::Noted, note});
    }
    if (source.seed) {
        if (!ct_grid) throw io::InputError("--from-ct needs --ct; expected both");
        mask = grown_in(ct, source, findings);
    }
    std::filesystem::path framed = source.ct;
    std::string frame = ct.frame_of_reference;
    for (const std::filesystem::path& file : source.masks) {
        PlacedMask placed = read_mask(file, source.labels, findings);
        VesselMask& more = placed.mask;
        require_frame(file, placed, framed, frame, ct_grid ? *ct_grid : mask.grid, source.any_frame,
                      findings);
        if (frame.empty()) framed = file, frame = placed.frame_of_reference;
        if (placed.only_marked && ct_grid)
            if (const auto offset = place_in(more.grid, *ct_grid)) move_into(*ct_grid, *offset, more);
        if (mask.inside.empty())
            mask = std::move(more);
        else if (same_grid(mask.grid, more.grid))
            for (std::size_t n = 0; n < mask.inside.size(); ++n) mask.inside[n] |= more.inside[n];
        else
            add_from(more, mask, file);
    }
    const std::filesystem::path& named = source.masks.empty() ? source.ct : source.masks[0];
    findings.push_back({Finding::Kind::Noted,
                        fmt::format("{} is placed by its header, in the patient's coordinates (LPS)",
                                    named.filename().string()),
                        Finding::Topic::Axes});
    if (ct_grid && !source.masks.empty() && !same_grid(mask.grid, *ct_grid))
        findings.push_back(
            {Finding::Kind::Noted,
             fmt::format("the mask's grid is not the CT's, which has {}; both are placed by their headers",
                         grid_text(*ct_grid))});
    ImportOptions options = given;
    options.unit = "mm";
    options.open_tubes = true;
    const auto located = [&](const io::InputError& error) {
        std::string text;
        for (std::size_t at = 0; const char c : std::string(error.what())) {
            if (at++ == 0 || text.back() == '\n') text += named.string() + ": ";
            text += c;
        }
        return io::InputError(text);
    };
    MaskSurface surface;
    try {
        surface = surface_of(std::move(mask), [&](double part) {
            report(0.05, part < 0.5 ? "smoothing the mask" : "making its surface");
        });
    } catch (const io::InputError& error) {
        throw located(error);
    }
    findings.insert(findings.end(), surface.findings.begin(), surface.findings.end());
    if (ct_grid)
        for (Finding& finding : compare_with_ct(surface.mesh, ct, source.ct))
            findings.push_back(std::move(finding));
    try {
        return import_lumen(surface.mesh, stem_of_mask(named), options, "lps", std::move(findings));
    } catch (const io::InputError& error) {
        throw located(error);
    }
}

}  // namespace anatomy
