#include "render/xray/contrast.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include "render/xray/surface_crossings.h"

namespace render {
namespace {

constexpr int samples = 2;  // rays along a side of a pixel
constexpr int rays = samples * samples;
/// Where a pixel's rays meet the same walls within this distance [mm], one path through the lumen represents
/// all.
constexpr float alike = 0.5f;

/// Length of each node's part of one pixel's rays.
class Row {
public:
    void add(std::uint32_t node, double length, const Vec3& at) {
        // Parts of a chord, and of the chords next to it, come in sequence.
        for (std::size_t i = entries_.size(); i-- > 0;) {
            if (entries_[i].node != node) continue;
            entries_[i].length += length;
            entries_[i].moment += length * at;
            return;
        }
        entries_.push_back({node, length, length * at});
    }
    void move_to(ContrastMatrix& matrix, std::uint32_t pixel) {
        if (entries_.empty()) return;
        std::sort(entries_.begin(), entries_.end(),
                  [](const Entry& a, const Entry& b) { return a.node < b.node; });
        for (const Entry& entry : entries_) {
            matrix.nodes.push_back(entry.node);
            matrix.lengths.push_back(static_cast<float>(entry.length));
            matrix.offsets.push_back((entry.moment / entry.length).cast<float>());
        }
        matrix.pixels.push_back(pixel);
        matrix.starts.push_back(static_cast<std::uint32_t>(matrix.nodes.size()));
        entries_.clear();
    }

private:
    struct Entry {
        std::uint32_t node;
        double length;
        Vec3 moment;  // length · place [mm²]
    };
    std::vector<Entry> entries_;
};

/// Power distance of a node along a path, minus the part common to all nodes.
struct Line {
    std::uint32_t node;
    double height, slope;  // at the start [mm²], [mm]
    double at(double s) const { return height + s * slope; }
};

/// Calls use(from, to) with the depths of every chord inside; false when entries and exits do not match.
template <class Use>
bool for_each_chord(std::span<const Crossing> met, const Use& use) {
    int inside = 0, least = 0;
    for (const Crossing& crossing : met) {
        inside += crossing.entry ? 1 : -1;
        least = std::min(least, inside);
    }
    if (inside != 0 || least < 0) {
        // At a hole, or where rounding puts the exit of a grazed wall before its entry.
        for (std::size_t i = 1; i < met.size(); ++i)
            if (met[i - 1].entry && !met[i].entry) use(met[i - 1].depth, met[i].depth);
        return inside == 0;
    }
    std::size_t outer = 0;
    for (std::size_t i = 0; i < met.size(); ++i) {
        if (inside == 0) outer = i;
        inside += met[i].entry ? 1 : -1;
        if (inside == 0) use(met[outer].depth, met[i].depth);
    }
    return true;
}

/// The mean of the rays; empty where they do not meet the same walls in the same order.
void average(const std::array<std::span<const Crossing>, rays>& met, std::vector<Crossing>& mean) {
    mean.clear();
    for (const auto& ray : met)
        if (ray.size() != met[0].size()) return;
    for (std::size_t i = 0; i < met[0].size(); ++i) {
        float low = met[0][i].depth, high = low, sum = 0;
        bool same = true;
        for (const auto& ray : met) {
            low = std::min(low, ray[i].depth);
            high = std::max(high, ray[i].depth);
            sum += ray[i].depth;
            same = same && ray[i].entry == met[0][i].entry;
        }
        if (!same || high - low > alike) {
            mean.clear();
            return;
        }
        mean.push_back({sum / rays, met[0][i].entry});
    }
}

/// Turns places relative to the nodes [mm] into offsets from the pieces' middles in parts of their reach.
void centre_offsets(ContrastMatrix& matrix) {
    const std::size_t count = static_cast<std::size_t>(matrix.node_count);
    std::vector<Vec3> middles(count, Vec3::Zero());
    std::vector<double> lengths(count, 0.0);
    for (std::size_t k = 0; k < matrix.nodes.size(); ++k) {
        middles[matrix.nodes[k]] += matrix.lengths[k] * matrix.offsets[k].cast<double>();
        lengths[matrix.nodes[k]] += matrix.lengths[k];
    }
    for (std::size_t n = 0; n < count; ++n)
        if (lengths[n] > 0) middles[n] /= lengths[n];
    std::vector<double> reach(count, 0.0);
    for (std::size_t k = 0; k < matrix.nodes.size(); ++k) {
        const std::uint32_t n = matrix.nodes[k];
        reach[n] = std::max(reach[n], (matrix.offsets[k].cast<double>() - middles[n]).norm());
    }
    for (std::size_t k = 0; k < matrix.nodes.size(); ++k) {
        const std::uint32_t n = matrix.nodes[k];
        const Vec3 offset = matrix.offsets[k].cast<double>() - middles[n];
        matrix.offsets[k] = (reach[n] > 0 ? Vec3(offset / reach[n]) : Vec3(Vec3::Zero())).cast<float>();
    }
    matrix.reaches.assign(reach.begin(), reach.end());
}

/// 1 + g·offset, never below 0 by rounding.
float mixed_part(const Eigen::Vector3f& stream, const Eigen::Vector3f& offset) {
    return std::max(0.0f, 1.0f + stream.dot(offset));
}

/// Sets the field to `width` squared pixels of zero.
void clear(Field& field, int width) {
    field.width = field.height = width;
    field.values.assign(static_cast<std::size_t>(width) * width, 0.0f);
}

}  // namespace

/// The lumen, and a coarse grid that lists the nodes that can be deepest anywhere in a cell; made for the
/// first contrast.
struct LumenContrast::Pieces {
    TriangleMesh mesh;
    std::vector<Vec3> nodes;
    std::vector<float> reaches;   // the radii [mm]
    std::vector<double> squares;  // of the radii [mm²]
    std::once_flag has_grid = {}, has_owners = {};
    std::vector<std::uint32_t> owners;  // node of each vertex, once it is asked for

    Vec3 low;          // corner of the grid [mm]
    double width = 0;  // of a cell [mm]
    std::array<int, 3> cells{};
    std::vector<std::uint32_t> starts, candidates;

    Pieces(const TriangleMesh& lumen, std::vector<Vec3> places, const std::vector<float>& radii);
    void require_grid() {
        std::call_once(has_grid, [this] { build_grid(reaches); });
    }
    void build_grid(const std::vector<float>& radii);
    void cut(const Vec3& from, const Vec3& to, double weight, std::vector<Line>& lines, Row& row) const;
};

LumenContrast::Pieces::Pieces(const TriangleMesh& lumen, std::vector<Vec3> places,
                              const std::vector<float>& radii)
    : mesh(lumen), nodes(std::move(places)), reaches(radii) {
    if (nodes.empty()) throw std::invalid_argument("a lumen needs one centreline node at least");
    if (nodes.size() != radii.size())
        throw std::invalid_argument(std::to_string(nodes.size()) + " nodes have " +
                                    std::to_string(radii.size()) + " radii; as many are needed");
    const auto finite = [](const Vec3& x) { return x.allFinite(); };
    if (!std::all_of(nodes.begin(), nodes.end(), finite))
        throw std::invalid_argument("a centreline node is not finite");
    if (!std::all_of(mesh.vertices.begin(), mesh.vertices.end(), finite))
        throw std::invalid_argument("the lumen has a vertex that is not finite");
    for (const float radius : radii) {
        if (!(radius > 0.0f && std::isfinite(radius)))
            throw std::invalid_argument("a centreline node has a radius that is not positive");
        squares.push_back(static_cast<double>(radius) * radius);
    }
    for (const auto& triangle : mesh.triangles)
        for (const int v : triangle)
            if (v < 0 || v >= static_cast<int>(mesh.vertices.size()))
                throw std::invalid_argument(
                    "the lumen has a triangle that names a vertex which is not there");
}

void LumenContrast::Pieces::build_grid(const std::vector<float>& radii) {
    low = nodes[0];
    Vec3 high = nodes[0];
    const auto cover = [&](const Vec3& x, double margin) {
        low = low.cwiseMin(x - Vec3::Constant(margin));
        high = high.cwiseMax(x + Vec3::Constant(margin));
    };
    for (std::size_t i = 0; i < nodes.size(); ++i) cover(nodes[i], radii[i]);
    for (const Vec3& vertex : mesh.vertices) cover(vertex, 0);
    // Cells as wide as a few nodes' distance, limited by memory.
    width = std::max(4.0, std::cbrt((high - low).prod() / 2e6));
    for (int k = 0; k < 3; ++k) cells[k] = std::max(1, static_cast<int>(std::ceil((high - low)[k] / width)));

    const std::size_t count = static_cast<std::size_t>(cells[0]) * cells[1] * cells[2];
    const double reach = 0.5 * std::sqrt(3.0) * width;
    const auto middle = [&](int i, int j, int k) {
        return Vec3(low + width * (Vec3(i, j, k) + Vec3::Constant(0.5)));
    };
    // Only cells near a vessel list candidates: those touched by the surface or a ball.
    std::vector<bool> wanted(count, false);
    const auto mark = [&](const Vec3& from, const Vec3& to) {
        int first[3], last[3];
        for (int k = 0; k < 3; ++k) {
            first[k] = std::clamp(static_cast<int>(std::floor((from[k] - low[k]) / width)), 0, cells[k] - 1);
            last[k] = std::clamp(static_cast<int>(std::floor((to[k] - low[k]) / width)), 0, cells[k] - 1);
        }
        for (int k = first[2]; k <= last[2]; ++k)
            for (int j = first[1]; j <= last[1]; ++j)
                for (int i = first[0]; i <= last[0]; ++i)
                    wanted[(static_cast<std::size_t>(k) * cells[1] + j) * cells[0] + i] = true;
    };
    for (std::size_t n = 0; n < nodes.size(); ++n)
        mark(nodes[n] - Vec3::Constant(radii[n]), nodes[n] + Vec3::Constant(radii[n]));
    for (const auto& t : mesh.triangles) {
        const Vec3 &p = mesh.vertices[t[0]], &q = mesh.vertices[t[1]], &r = mesh.vertices[t[2]];
        mark(p.cwiseMin(q).cwiseMin(r), p.cwiseMax(q).cwiseMax(r));
    }
    starts.assign(count + 1, 0);
    std::vector<double> powers(nodes.size());
    std::size_t cell = 0;
    for (int k = 0; k < cells[2]; ++k) {
        for (int j = 0; j < cells[1]; ++j) {
            for (int i = 0; i < cells[0]; ++i, ++cell) {
                if (wanted[cell]) {
                    // The power distances of two nodes differ by a linear function: over the cell's ball it
                    // varies by at most its radius times twice the distance between the nodes.
                    const Vec3 centre = middle(i, j, k);
                    std::size_t best = 0;
                    for (std::size_t n = 0; n < nodes.size(); ++n) {
                        powers[n] = (centre - nodes[n]).squaredNorm() - squares[n];
                        if (powers[n] < powers[best]) best = n;
                    }
                    for (std::size_t n = 0; n < nodes.size(); ++n) {
                        if (powers[n] - powers[best] <= 2 * reach * (nodes[n] - nodes[best]).norm())
                            candidates.push_back(static_cast<std::uint32_t>(n));
                    }
                }
                starts[cell + 1] = static_cast<std::uint32_t>(candidates.size());
            }
        }
    }
}

/// Divides the path from one point to another, both in the lumen, among the nodes. Along a line the power
/// distances, minus the part common to all, are linear: another node becomes deepest where its line crosses
/// the lowest.
void LumenContrast::Pieces::cut(const Vec3& from, const Vec3& to, double weight, std::vector<Line>& lines,
                                Row& row) const {
    const double length = (to - from).norm();
    if (!(length > 0)) return;
    const Vec3 direction = (to - from) / length;
    double s = 0;
    while (s < length) {
        // The cell just ahead, and where the path leaves it.
        std::size_t cell = 0;
        double leave = length;
        for (int k = 2; k >= 0; --k) {
            const double at = (from[k] + s * direction[k] - low[k]) / width;
            int index = static_cast<int>(std::floor(at));
            if (direction[k] < 0 && at == index) --index;
            if (direction[k] != 0)
                leave = std::min(leave, (low[k] + width * (direction[k] > 0 ? index + 1 : index) - from[k]) /
                                            direction[k]);
            cell = cell * cells[k] + std::clamp(index, 0, cells[k] - 1);
        }
        leave = std::min(length, std::max(leave, s + 1e-6));

        lines.clear();
        const auto add_line = [&](std::uint32_t n) {
            const Vec3 off = nodes[n] - from;
            lines.push_back({n, off.squaredNorm() - squares[n], -2 * direction.dot(off)});
        };
        for (std::uint32_t c = starts[cell]; c < starts[cell + 1]; ++c) add_line(candidates[c]);
        if (lines.empty())  // inside a vessel that its nodes' balls do not fill
            for (std::uint32_t n = 0; n < nodes.size(); ++n) add_line(n);
        Line deepest = *std::min_element(lines.begin(), lines.end(),
                                         [s](const Line& a, const Line& b) { return a.at(s) < b.at(s); });
        while (s < leave) {
            double until = leave;
            Line next = deepest;
            for (const Line& line : lines) {
                if (line.slope >= deepest.slope) continue;
                const double crossing = (line.height - deepest.height) / (deepest.slope - line.slope);
                if (crossing < until) until = crossing, next = line;
            }
            if (until > s)
                row.add(deepest.node, weight * (until - s),
                        from + 0.5 * (s + until) * direction - nodes[deepest.node]);
            s = std::max(s, until);
            deepest = next;
            if (until == leave) break;
        }
    }
}

LumenContrast::LumenContrast(const TriangleMesh& lumen, std::vector<Vec3> nodes,
                             const std::vector<float>& radii)
    : pieces_(std::make_unique<Pieces>(lumen, std::move(nodes), radii)) {}
LumenContrast::~LumenContrast() = default;
LumenContrast::LumenContrast(LumenContrast&&) noexcept = default;
LumenContrast& LumenContrast::operator=(LumenContrast&&) noexcept = default;

const TriangleMesh& LumenContrast::mesh() const {
    return pieces_->mesh;
}

std::vector<Vec3> LumenContrast::moved_vertices(std::span<const Eigen::Vector3f> of_nodes) const {
    Pieces& pieces = *pieces_;
    assert(of_nodes.size() == pieces.nodes.size());
    std::call_once(pieces.has_owners, [&pieces] {
        for (const Vec3& x : pieces.mesh.vertices) {
            std::uint32_t owner = 0;
            double least = std::numeric_limits<double>::max();
            for (std::uint32_t n = 0; n < pieces.nodes.size(); ++n) {
                const double power = (x - pieces.nodes[n]).squaredNorm() - pieces.squares[n];
                if (power < least) least = power, owner = n;
            }
            pieces.owners.push_back(owner);
        }
    });
    std::vector<Vec3> vertices = pieces.mesh.vertices;
    for (std::size_t v = 0; v < vertices.size(); ++v)
        vertices[v] += of_nodes[pieces.owners[v]].cast<double>();
    return vertices;
}

LumenContrast LumenContrast::moved(std::span<const Eigen::Vector3f> of_nodes) const {
    TriangleMesh mesh = pieces_->mesh;
    mesh.vertices = moved_vertices(of_nodes);
    std::vector<Vec3> nodes = pieces_->nodes;
    for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n] += of_nodes[n].cast<double>();
    return {mesh, std::move(nodes), pieces_->reaches};
}

LumenContrast LumenContrast::reshaped(std::span<const VertexMove> moves) const {
    TriangleMesh mesh = pieces_->mesh;
    for (const VertexMove& move : moves) mesh.vertices.at(move.vertex) += move.by.cast<double>();
    return {mesh, pieces_->nodes, pieces_->reaches};
}

std::span<const Vec3> LumenContrast::nodes() const {
    return pieces_->nodes;
}

ContrastMatrix LumenContrast::at(const CArm& arm) const {
    pieces_->require_grid();
    const SurfaceCrossings crossings = surface_crossings(pieces_->mesh, arm, samples);
    const ArmAxes a = axes(arm);
    const int side = crossings.side;
    const double step = pixel_width(arm) / arm.sid / samples;

    ContrastMatrix matrix;
    matrix.width = arm.pixels;
    matrix.node_count = static_cast<int>(pieces_->nodes.size());
    Row row;
    std::vector<Line> lines;
    std::vector<Crossing> mean;
    // u and v in rays from the image's corner.
    const auto cut_along = [&](std::span<const Crossing> met, double u, double v, int count) {
        const Vec3 across = (u - 0.5 * side) * step * a.right - (v - 0.5 * side) * step * a.up;
        const Vec3 origin = arm.isocentre + arm.sod * across, direction = a.beam + across;
        const double weight = static_cast<double>(count) / rays;
        const bool balanced = for_each_chord(met, [&](double from, double to) {
            pieces_->cut(origin + from * direction, origin + to * direction, weight, lines, row);
        });
        if (!balanced) matrix.unbalanced_rays += count;
    };
    for (int pixel = 0; pixel < arm.pixels * arm.pixels; ++pixel) {
        const int u = pixel % arm.pixels * samples, v = pixel / arm.pixels * samples;
        std::array<std::span<const Crossing>, rays> met;
        bool any = false;
        for (int ray = 0; ray < rays; ++ray) {
            met[ray] = crossings.of(u + ray % samples, v + ray / samples);
            any = any || !met[ray].empty();
        }
        if (!any) continue;
        average(met, mean);
        if (!mean.empty()) {
            cut_along(mean, u + 0.5 * samples, v + 0.5 * samples, rays);
        } else {
            for (int ray = 0; ray < rays; ++ray)
                if (!met[ray].empty())
                    cut_along(met[ray], u + ray % samples + 0.5, v + ray / samples + 0.5, 1);
        }
        row.move_to(matrix, static_cast<std::uint32_t>(pixel));
    }
    centre_offsets(matrix);
    return matrix;
}

void iodine_thickness(const ContrastMatrix& matrix, std::span<const float> iodine, Field& out,
                      std::span<const Eigen::Vector3f> streams) {
    assert(static_cast<int>(iodine.size()) == matrix.node_count);
    assert(streams.empty() || streams.size() == iodine.size());
    clear(out, matrix.width);
    for (std::size_t row = 0; row < matrix.pixels.size(); ++row) {
        float sum = 0.0f;
        for (std::uint32_t k = matrix.starts[row]; k < matrix.starts[row + 1]; ++k)
            sum += streams.empty() ? matrix.lengths[k] * iodine[matrix.nodes[k]]
                                   : matrix.lengths[k] * iodine[matrix.nodes[k]] *
                                         mixed_part(streams[matrix.nodes[k]], matrix.offsets[k]);
        out.values[matrix.pixels[row]] = sum;
    }
}

std::vector<std::uint16_t> longest_label(const ContrastMatrix& matrix,
                                         std::span<const std::uint16_t> of_node) {
    std::vector<std::uint16_t> longest(matrix.pixels.size());
    std::vector<std::pair<std::uint16_t, float>> lengths;  // of a row, by label
    for (std::size_t row = 0; row < longest.size(); ++row) {
        lengths.clear();
        for (std::uint32_t i = matrix.starts[row]; i < matrix.starts[row + 1]; ++i) {
            const std::uint16_t label = of_node[matrix.nodes[i]];
            const auto known = std::find_if(lengths.begin(), lengths.end(),
                                            [&](const auto& entry) { return entry.first == label; });
            if (known == lengths.end())
                lengths.emplace_back(label, matrix.lengths[i]);
            else
                known->second += matrix.lengths[i];
        }
        longest[row] = std::max_element(lengths.begin(), lengths.end(), [](const auto& a, const auto& b) {
                           return a.second < b.second || (a.second == b.second && a.first > b.first);
                       })->first;
    }
    return longest;
}

std::vector<PixelShift> pixel_shifts(const CArm& arm, std::span<const Vec3> nodes,
                                     std::span<const Vec3> moved) {
    assert(nodes.size() == moved.size());
    constexpr double together = 4;  // nodes of one vessel, next to each other [mm]
    std::vector<PixelShift> shifts;
    shifts.reserve(nodes.size());
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const Pixel before = project(arm, nodes[n]), after = project(arm, moved[n]);
        shifts.push_back({static_cast<float>(after.x - before.x), static_cast<float>(after.y - before.y)});
    }
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto near = [&](std::size_t other) { return (nodes[other] - nodes[n]).norm() < together; };
        const std::size_t from = n > 0 && near(n - 1) ? n - 1 : n,
                          to = n + 1 < nodes.size() && near(n + 1) ? n + 1 : n;
        const Eigen::Vector3f along = (nodes[to] - nodes[from]).cast<float>();
        const float square = along.squaredNorm();
        if (!(square > 0)) continue;
        shifts[n].change_of_x = (shifts[to].x - shifts[from].x) / square * along;
        shifts[n].change_of_y = (shifts[to].y - shifts[from].y) / square * along;
    }
    return shifts;
}

void iodine_thickness(const ContrastMatrix& matrix, std::span<const float> iodine,
                      std::span<const PixelShift> shifts, Field& out,
                      std::span<const Eigen::Vector3f> streams) {
    assert(static_cast<int>(iodine.size()) == matrix.node_count && shifts.size() == iodine.size());
    clear(out, matrix.width);
    struct Moved {
        int x, y;
        std::array<float, 4> fraction;  // upper left, upper right, lower left, lower right
    };
    const auto moved = [](float right, float down) {
        // Anything farther than this is outside every image.
        const float x = std::clamp(right, -1e4f, 1e4f), y = std::clamp(down, -1e4f, 1e4f);
        const float left = std::floor(x), top = std::floor(y), u = x - left, v = y - top;
        return Moved{static_cast<int>(left),
                     static_cast<int>(top),
                     {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
    };
    constexpr float visible = 0.02f;  // difference of shifts in a piece [pixels]
    std::vector<Moved> nodes;
    std::vector<char> stretched;
    nodes.reserve(iodine.size());
    for (std::size_t n = 0; n < iodine.size(); ++n) {
        nodes.push_back(moved(shifts[n].x, shifts[n].y));
        stretched.push_back(
            matrix.reaches[n] * (shifts[n].change_of_x.norm() + shifts[n].change_of_y.norm()) > visible);
    }
    const int width = matrix.width;
    const auto put = [&out, width](int i, int j, const Moved& node, float mass) {
        const int x = i + node.x, y = j + node.y;
        if (x >= 0 && y >= 0 && x + 1 < width && y + 1 < width) {
            float* at = out.values.data() + static_cast<std::size_t>(y) * width + x;
            at[0] += mass * node.fraction[0];
            at[1] += mass * node.fraction[1];
            at[width] += mass * node.fraction[2];
            at[width + 1] += mass * node.fraction[3];
            return;
        }
        for (int tap = 0; tap < 4; ++tap) {
            const int u = x + tap % 2, v = y + tap / 2;
            if (u >= 0 && v >= 0 && u < width && v < width)
                out.values[static_cast<std::size_t>(v) * width + u] += mass * node.fraction[tap];
        }
    };
    for (std::size_t row = 0; row < matrix.pixels.size(); ++row) {
        const int i = static_cast<int>(matrix.pixels[row]) % width;
        const int j = static_cast<int>(matrix.pixels[row]) / width;
        for (std::uint32_t k = matrix.starts[row]; k < matrix.starts[row + 1]; ++k) {
            const std::uint32_t n = matrix.nodes[k];
            if (iodine[n] == 0.0f) continue;
            const float mass =
                iodine[n] * (streams.empty() ? matrix.lengths[k]
                                             : matrix.lengths[k] * mixed_part(streams[n], matrix.offsets[k]));
            if (!stretched[n]) {
                put(i, j, nodes[n], mass);
                continue;
            }
            // In two halves of the pixel across the stretch: whole pixels would lie farther apart than they
            // are wide.
            const PixelShift& shift = shifts[n];
            const Eigen::Vector3f away = matrix.reaches[n] * matrix.offsets[k];
            const float x = shift.x + shift.change_of_x.dot(away), y = shift.y + shift.change_of_y.dot(away);
            const bool down = shift.change_of_y.squaredNorm() > shift.change_of_x.squaredNorm();
            for (const float half : {-0.25f, 0.25f})
                put(i, j, moved(x + (down ? 0 : half), y + (down ? half : 0)), 0.5f * mass);
        }
    }
}

}  // namespace render
