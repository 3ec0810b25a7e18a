#include "physics/wall/distance_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <ostream>
#include <stdexcept>
#include <string>

#include "physics/geometry/bspline_grid.h"
#include "physics/geometry/checksum.h"
#include "physics/geometry/lumen_surface.h"
#include "physics/wall/field_sampler.h"
#include "physics/wall/packed_values.h"
#include "physics/wall/past_end.h"
#include "physics/wall/vessel_sheets.h"

namespace physics {
namespace {

/// The spline changes by no more than 1 / least_slope per mm, creases of the wall included.
constexpr double least_slope = 0.9;
/// Of a cell of the band, including what bricks at its rim waste: 15 for a tube of radius 1 mm and for the
/// iliac arteries.
constexpr double bytes_per_cell = 16;
constexpr double while_made = 2;  // times that
/// Raised whenever the bits of a field change for the same mesh, or the layout of a saved one.
constexpr std::uint32_t file_version = 10;

/// Of the file, before the body, which begins where a grid may.
struct FileHead {
    char magic[8] = {'S', 'E', 'L', 'D', 'F', 'L', 'D', '\n'};
    std::uint64_t version = file_version, bytes = 0, checksum = 0;  // the last two of the body
    std::uint64_t padding[4] = {};
};
static_assert(sizeof(FileHead) == SplineGrid::alignment);

/// A wall is known before it is touched, and to few different depths. Wires of 2.2 mm come to rest with as
/// much of the usual depth to spare.
constexpr double to_spare = 0.15, depth_step = 0.5;  // [mm]

double chosen_spacing(double wanted, std::span<const CentrelineBranch> branches) {
    if (wanted != 0) return wanted;
    double smallest = std::numeric_limits<double>::max();
    for (const CentrelineBranch& branch : branches)
        for (const double radius : branch.radii) smallest = std::min(smallest, radius);
    return std::clamp(smallest / 6, 0.2, 0.3);
}
/// The radius from which twice the spacing is fine enough, a sixth as in the smallest vessel, and from twice
/// that radius four times; none when the spacing was chosen.
double wide_from(double wanted, double spacing) {
    return wanted != 0 ? std::numeric_limits<double>::infinity() : 12 * spacing;
}

/// Walls that do not see one another and are this close lie in different sheets, so that no cell of the band
/// needs nodes that are nearest to the other wall [mm].
auto nearness(double outer, double spacing, double wide) {
    return [=](double radius) { return outer + 2 * spacing * (1 << level_of(radius, wide)); };
}

/// The next place where a grid may begin.
std::size_t aligned(std::size_t at) {
    constexpr std::size_t even = SplineGrid::alignment;
    return (at + even - 1) / even * even;
}

void check(double wire_radius, double inner) {
    if (!(wire_radius >= 0 && wire_radius < inner))
        throw std::invalid_argument("the wire's radius must be >= 0 and below the field's depth of " +
                                    std::to_string(inner) + " mm");
}

}  // namespace

FieldEstimate DistanceField::estimate(std::span<const CentrelineBranch> branches,
                                      const DistanceFieldOptions& options) {
    const double h = chosen_spacing(options.spacing, branches), wide = wide_from(options.spacing, h);
    double cells = 0;
    for (const CentrelineBranch& branch : branches)
        for (std::size_t i = 1; i < branch.points.size(); ++i) {
            const double side = h * (1 << level_of(branch.radii[i], wide));
            cells += band_section(branch.radii[i], options.inner, options.outer) *
                     (branch.points[i] - branch.points[i - 1]).norm() / (side * side * side);
        }
    return {h, cells * bytes_per_cell, while_made * (cells * bytes_per_cell)};
}

struct DistanceField::Data {
    CentrelineTree tree;
    SheetMap sheets;
    std::vector<SheetField> fields;  // per sheet
    double spacing, inner, outer;
    double wide;  // radius of vessels known at twice the spacing [mm]
    WallStiffness stiffness;
    double wire_radius;
    std::uint64_t fingerprint;
    std::string packed_values;  // where it is packable
    std::vector<ContinuedEnd> ends = continued_ends(tree.ends());

    WallContact contact(const Vec3& x, const WallContact& asked) const;
    void ask_grid(const Vec3& x, WallContact&) const;
    bool continued(const SheetField&, const Vec3& x, int station, double t, SplineValue&) const;
};

DistanceField::DistanceField(const TriangleMesh& lumen, std::span<const CentrelineBranch> branches,
                             std::vector<OpenEnd> ends, WallStiffness stiffness, double wire_radius,
                             const DistanceFieldOptions& options,
                             const std::function<void(double)>& progress) {
    if (!(options.spacing >= 0 && std::isfinite(options.spacing) && options.inner > 0 && options.outer > 0 &&
          std::isfinite(options.inner + options.outer)))
        throw std::invalid_argument("a distance field's spacing, inner and outer band must be positive");
    check(wire_radius, options.inner);
    // Before any work: the estimate is known to that factor, and the sampler counts exactly.
    constexpr double sure = 1.25;
    if (const FieldEstimate e = estimate(branches, options);
        e.bytes_while > sure * static_cast<double>(options.largest))
        refuse_size(e.spacing, e.bytes_while, options.largest);
    const std::uint64_t print = fingerprint(lumen, branches, ends, options);
    CentrelineTree tree(branches, std::move(ends));
    const double h = chosen_spacing(options.spacing, branches), wide = wide_from(options.spacing, h);
    const FieldBand band{
        h, options.inner, options.outer, wide, std::max(1, options.threads), options.largest};
    VesselSheets sheets = vessel_sheets(tree, nearness(options.outer, h, wide));
    const LumenSurface surface = lumen_surface(lumen, tree);
    std::vector<SheetField> fields = sampled_values(surface, tree, sheets, band, progress);
    std::string values;
    if (options.packable) values = packed_values(fields);
    fit(fields, band.threads);
    data_.reset(new Data{std::move(tree), std::move(sheets.map), std::move(fields), h, options.inner,
                         options.outer, wide, std::move(stiffness), wire_radius, print, std::move(values)});
}

DistanceField::DistanceField(std::unique_ptr<Data> data) : data_(std::move(data)) {}
DistanceField::DistanceField(DistanceField&&) noexcept = default;
DistanceField::~DistanceField() = default;

double DistanceField::depth_for(double radius) {
    const double usual = DistanceFieldOptions().inner;
    if (radius < usual) return usual;
    return usual + depth_step * std::ceil((radius + to_spare - usual) / depth_step);
}

const CentrelineTree& DistanceField::tree() const {
    return data_->tree;
}
double DistanceField::spacing() const {
    return data_->spacing;
}
std::size_t DistanceField::bytes() const {
    std::size_t sum = 0;
    for (const SheetField& field : data_->fields) sum += field.bytes();
    return sum;
}

WallContact DistanceField::Data::contact(const Vec3& x, const WallContact& asked) const {
    WallContact c;
    c.thickness = asked.thickness;
    const int own =
        asked.held ? tree.locate_within(x, asked.station, sheets.sheet_of) : tree.locate(x, asked.station);
    c.station = sheets.gone_over(tree, x, own);
    c.held = asked.held && asked.station >= 0 && sheets.sheet_of[c.station] == sheets.sheet_of[asked.station];
    c.stiffness = stiffness.mean();
    const PastEnd past(x, ends, tree.ends_at(c.station), spacing);
    const double joint = wire_radius + c.thickness;
    if (past.inside()) {
        ask_grid(x, c);
        past.limit(x, joint, c);
    } else {
        c.clearance = tree.stations()[c.station].radius - joint;
        if (!past.alone()) ask_grid(past.seen_at(x), c);
        past.apply(x, joint, inner - joint, c);
    }
    if (!stiffness.uniform() && !c.normal.isZero(0)) stiffness.apply(tree.coordinate(c.station, x), c);
    if (!past.inside()) past.part_cusps(x, joint, stiffness.joint_length(), c);
    return c;
}

/// The field goes on straight from the place that lies `t` nearer to the centreline [mm]. That place moves
/// with x, so that the slope is not the field's own there. False where that place is off the band, too.
bool DistanceField::Data::continued(const SheetField& sheet, const Vec3& x, int station, double t,
                                    SplineValue& out) const {
    const auto value = [&](const Vec3& at, SplineValue& field) {
        const Vec3 place = at + t * (tree.closest_point(station, at) - at).normalized();
        if (!sheet.evaluate(place, field)) return false;
        field.value += field.gradient.dot(at - place);
        return true;
    };
    if (!value(x, out)) return false;
    constexpr double step = 1e-4;  // of the differences [mm]
    for (int d = 0; d < 3; ++d) {
        SplineValue before, after;
        if (value(x - step * Vec3::Unit(d), before) && value(x + step * Vec3::Unit(d), after))
            out.gradient[d] = (after.value - before.value) / (2 * step);
    }
    return true;
}

void DistanceField::Data::ask_grid(const Vec3& x, WallContact& c) const {
    const Station& station = tree.stations()[c.station];
    const double depth = station.radius - (x - station.centre).norm();  // in the inscribed ball
    const double joint = wire_radius + c.thickness, inside = depth - joint;
    c.clearance = station.radius - joint;
    c.penetration = -std::max(inside, 1e-3);
    c.trust = std::max(0.0, inside - centreline_error);
    if (depth > inner + centreline_error) return;

    const SheetField& sheet = fields[sheets.sheet_of[c.station]];
    SplineValue field;
    if (sheet.evaluate(x, field)) {
        c.penetration = field.value + joint;
        c.normal = field.gradient;
        c.curvature = field.hessian;
        c.trust = std::max(0.0, -least_slope * c.penetration);
        return;
    }
    // Off the band: outside it, if the way to the centreline meets it at a place outside the wall.
    const double length = (tree.closest_point(c.station, x) - x).norm();
    // The band lies no farther from the centreline than lumens that are not round and the coarsest bricks
    // reach.
    const double brick = SplineGrid::brick_side * spacing * (1 << (SheetField::level_count - 1));
    const double reach = 2 * station.radius + outer + std::numbers::sqrt3 * brick;
    const double from = std::max(1.0, std::floor((length - reach) / spacing)) * spacing;
    for (double t = from; t < length; t += spacing) {
        if (!continued(sheet, x, c.station, t, field)) continue;
        if (field.value <= 0) break;
        c.penetration = field.value + joint;
        c.normal = field.gradient;
        c.trust = 0;
        return;
    }
    // Inside, where no wall is nearer than the band is deep.
    c.penetration = -std::max(inside, inner - joint);
    c.trust = std::max(c.trust, least_slope * (inner - joint));
}

bool DistanceField::same_vessel(int station, int other) const {
    return data_->tree.same_branch(station, other);
}

void DistanceField::apply_stiffness(const Vec3& x, WallContact& c) const {
    if (!data_->stiffness.uniform()) data_->stiffness.apply(data_->tree.coordinate(c.station, x), c);
}

void DistanceField::rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const {
    require_finite(joints);
    for (std::size_t i = 0; i < joints.size(); ++i) contacts[i] = data_->contact(joints[i], contacts[i]);
}

std::uint64_t DistanceField::fingerprint(const TriangleMesh& lumen,
                                         std::span<const CentrelineBranch> branches,
                                         std::span<const OpenEnd> ends, const DistanceFieldOptions& options) {
    std::uint64_t hash = file_version;
    auto mix = [&](const auto* values, std::size_t count) {
        hash = checksum(std::as_bytes(std::span(values, count)), hash);
    };
    const double band[3] = {options.spacing, options.inner, options.outer};
    mix(band, 3);
    mix(lumen.vertices.data(), lumen.vertices.size());
    mix(lumen.triangles.data(), lumen.triangles.size());
    for (const CentrelineBranch& branch : branches) {
        mix(&branch.parent, 1);
        mix(branch.points.data(), branch.points.size());
        mix(branch.radii.data(), branch.radii.size());
    }
    for (const OpenEnd& end : ends) {
        mix(&end.centre, 1);
        mix(&end.outward_normal, 1);
        mix(&end.radius, 1);
    }
    return hash;
}

namespace {

/// What a file begins with, before its grids.
struct Described {
    std::uint64_t fingerprint = 0;
    std::array<double, 4> band{};           // spacing, inner, outer, wide [mm]
    std::array<std::uint64_t, 2> counts{};  // of sheets, of stations
    SheetMap sheets;

    void write(std::string& body) const {
        const auto add = [&](const auto* values, std::size_t count) {
            body.append(reinterpret_cast<const char*>(values), count * sizeof *values);
        };
        add(&fingerprint, 1);
        add(band.data(), band.size());
        add(counts.data(), counts.size());
        add(sheets.sheet_of.data(), sheets.sheet_of.size());
        for (const std::vector<int>& entries : sheets.entries) {
            const int count = static_cast<int>(entries.size());
            add(&count, 1);
            add(entries.data(), entries.size());
        }
    }
    /// The number of bytes that were read.
    std::size_t read(std::span<const std::byte> body, const char* damaged) {
        std::size_t at = 0;
        const auto take = [&](auto* values, std::size_t count) {
            if (count > (body.size() - at) / sizeof *values) throw std::runtime_error(damaged);
            if (count > 0) std::memcpy(values, body.data() + at, count * sizeof *values);
            at += count * sizeof *values;
        };
        take(&fingerprint, 1);
        take(band.data(), band.size());
        take(counts.data(), counts.size());
        if (counts[1] > body.size() / sizeof(int)) throw std::runtime_error(damaged);
        sheets.sheet_of.resize(counts[1]);
        sheets.entries.resize(counts[1]);
        take(sheets.sheet_of.data(), sheets.sheet_of.size());
        for (std::vector<int>& entries : sheets.entries) {
            int count = 0;
            take(&count, 1);
            if (count < 0 || static_cast<std::size_t>(count) > body.size()) throw std::runtime_error(damaged);
            entries.resize(static_cast<std::size_t>(count));
            take(entries.data(), entries.size());
        }
        return at;
    }
};

std::string file_of(const Described& described, const std::vector<SheetField>& fields) {
    std::string body;
    described.write(body);
    body.resize(aligned(body.size()), '\0');
    for (const SheetField& field : fields)
        for (const SplineGrid& grid : field.grids) grid.save(body);
    FileHead head;
    head.bytes = body.size();
    head.checksum = checksum(std::as_bytes(std::span(body)));
    return std::string(reinterpret_cast<const char*>(&head), sizeof head) + body;
}

}  // namespace

void DistanceField::save(std::ostream& out) const {
    const std::string file = file_of({data_->fingerprint,
                                      {data_->spacing, data_->inner, data_->outer, data_->wide},
                                      {data_->fields.size(), data_->sheets.sheet_of.size()},
                                      data_->sheets},
                                     data_->fields);
    out.write(file.data(), static_cast<std::streamsize>(file.size()));
}

std::string DistanceField::packed() const {
    if (data_->packed_values.empty()) throw std::logic_error("a distance field that was not made packable");
    std::string all;
    Described{data_->fingerprint,
              {data_->spacing, data_->inner, data_->outer, data_->wide},
              {data_->fields.size(), data_->sheets.sheet_of.size()},
              data_->sheets}
        .write(all);
    return all + data_->packed_values;
}

std::string DistanceField::unpacked(std::span<const std::byte> packed, std::size_t largest) {
    const char* const damaged = "the packed distance field is damaged";
    Described described;
    const std::size_t at = described.read(packed, damaged);
    const double h = described.band[0];
    if (!(h > 0 && std::isfinite(h))) throw std::runtime_error(damaged);
    std::vector<SheetField> fields = unpacked_values(packed.subspan(at), h, described.counts[0], largest);
    fit(fields, 1);
    return file_of(described, fields);
}

DistanceField DistanceField::load(std::span<const std::byte> bytes, std::shared_ptr<const void> held,
                                  std::uint64_t fingerprint, std::span<const CentrelineBranch> branches,
                                  std::vector<OpenEnd> ends, WallStiffness stiffness, double wire_radius) {
    const auto require = [](bool holds, const char* otherwise) {
        if (!holds) throw std::runtime_error(otherwise);
    };
    FileHead head;
    require(bytes.size() >= sizeof head && std::memcmp(bytes.data(), head.magic, sizeof head.magic) == 0,
            "this is not a saved distance field");
    std::memcpy(&head, bytes.data(), sizeof head);
    require(head.version == file_version, "the distance field was saved by another version");
    require(std::ranges::all_of(head.padding, [](std::uint64_t word) { return word == 0; }),
            "this is not a saved distance field");
    require(head.bytes == bytes.size() - sizeof head,
            "the saved distance field is cut short or longer than it was");
    const std::span<const std::byte> body = bytes.subspan(sizeof head, static_cast<std::size_t>(head.bytes));
    const char* const damaged = "the saved distance field is damaged";
    require(checksum(body) == head.checksum, damaged);

    Described found;
    std::size_t at = aligned(found.read(body, damaged));
    require(found.fingerprint == fingerprint, "the saved distance field is of another lumen");
    const auto& band = found.band;
    check(wire_radius, band[1]);
    CentrelineTree tree(branches, std::move(ends));
    require(found.counts[1] == tree.stations().size(), damaged);
    std::vector<SheetField> fields;
    for (std::uint64_t sheet = 0; sheet < found.counts[0]; ++sheet) {
        fields.emplace_back();
        for (int level = 0; level < SheetField::level_count; ++level) {
            require(at < body.size(), damaged);
            const std::span<const std::byte> rest = body.subspan(at);
            const std::size_t size = SplineGrid::saved_bytes(rest);
            require(size <= rest.size(), damaged);
            fields.back().grids.emplace_back(band[0] * (1 << level), rest.first(size), held);
            at += size;
        }
    }
    return DistanceField(std::unique_ptr<Data>(new Data{std::move(tree),
                                                        std::move(found.sheets),
                                                        std::move(fields),
                                                        band[0],
                                                        band[1],
                                                        band[2],
                                                        band[3],
                                                        std::move(stiffness),
                                                        wire_radius,
                                                        fingerprint,
                                                        {}}));
}

}  // namespace physics
