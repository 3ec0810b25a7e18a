#include "physics/wall/packed_values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "physics/geometry/range_coder.h"

namespace physics {
namespace {

constexpr int side = SplineGrid::brick_side;
constexpr int most_steps = 1 << 28;          // of a value
constexpr int farthest = 1 << 19;            // of a brick from the origin
constexpr int pad = 2, across = side + pad;  // a brick with two layers of nodes of those below it

using Brick = SplineGrid::Brick;
using BrickList = std::vector<Brick>;

int at(int i, int j, int k) {
    return (i * across + j) * across + k;
}

/// Values around a node that are known before it, in steps, as weights in 1/256.
struct Predictor {
    struct Term {
        int i, j, k, weight;
    };
    std::vector<Term> terms;
    std::array<int, 3> reach{};

    explicit Predictor(std::vector<Term> of) : terms(std::move(of)) {
        for (const Term& t : terms)
            reach = {std::max(reach[0], t.i), std::max(reach[1], t.j), std::max(reach[2], t.k)};
    }
};

/// The best first; each needs fewer neighbours than those before it.
const std::vector<Predictor>& predictors() {
    static const std::vector<Predictor> all = [] {
        std::vector<Predictor::Term> wide;
        // Least absolute residuals over the fields of two exercises, the same for all orders of the axes. By
        // the sum of the squares of the offsets.
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                for (int k = 0; k < 3; ++k) {
                    constexpr std::array<int, 6> weight{0, 195, -104, 16, -29, 9};
                    const int squares = i * i + j * j + k * k;
                    if (i + j + k > 0 && i + j + k <= 3)
                        wide.push_back({i, j, k, weight[static_cast<std::size_t>(squares)]});
                }
        constexpr int one = 256;
        return std::vector<Predictor>{
            Predictor(wide),
            Predictor({{1, 0, 0, one},
                       {0, 1, 0, one},
                       {0, 0, 1, one},
                       {1, 1, 0, -one},
                       {1, 0, 1, -one},
                       {0, 1, 1, -one},
                       {1, 1, 1, one}}),
            Predictor({{1, 0, 0, one}, {0, 1, 0, one}, {1, 1, 0, -one}}),
            Predictor({{1, 0, 0, one}, {0, 0, 1, one}, {1, 0, 1, -one}}),
            Predictor({{0, 1, 0, one}, {0, 0, 1, one}, {0, 1, 1, -one}}),
            Predictor({{0, 0, 1, 2 * one}, {0, 0, 2, -one}}),
            Predictor({{0, 1, 0, 2 * one}, {0, 2, 0, -one}}),
            Predictor({{1, 0, 0, 2 * one}, {2, 0, 0, -one}}),
            Predictor({{0, 0, 1, one}}),
            Predictor({{0, 1, 0, one}}),
            Predictor({{1, 0, 0, one}}),
            Predictor({}),
        };
    }();
    return all;
}

/// For each set of the seven bricks below that there are, the predictor of each node.
class Choices {
public:
    Choices() {
        for (unsigned there = 0; there < 256; there += 2)
            for (int node = 0; node < SplineGrid::node_count; ++node)
                choice_[there | 1][static_cast<std::size_t>(node)] =
                    static_cast<std::uint8_t>(best(there | 1, node));
    }
    int operator()(unsigned there, int node) const { return choice_[there][static_cast<std::size_t>(node)]; }

private:
    /// Bit n of `there`: the brick that lies n >> 2, n >> 1 & 1, n & 1 below.
    static std::size_t best(unsigned there, int node) {
        const std::array<int, 3> place{node >> 4, node >> 2 & 3, node & 3};
        for (std::size_t p = 0;; ++p) {
            const bool known = std::ranges::all_of(predictors()[p].terms, [&](const Predictor::Term& t) {
                const int brick =
                    (place[0] < t.i ? 4 : 0) | (place[1] < t.j ? 2 : 0) | (place[2] < t.k ? 1 : 0);
                return there >> brick & 1;
            });
            if (known) return p;
        }
    }
    std::array<std::array<std::uint8_t, SplineGrid::node_count>, 256> choice_{};
};

/// Predicts how far the next value will be off, from how far its neighbours were: least absolute errors over
/// what has been seen. Additions, multiplications and divisions alone: both sides compute the same bits.
class Learner {
public:
    static constexpr std::size_t inputs = 7;
    using Inputs = std::array<double, inputs>;

    double expected(const Inputs& x) const {
        double sum = 0;
        for (std::size_t k = 0; k < inputs; ++k) sum += weight_[k] * x[k];
        return sum;
    }
    void learn(const Inputs& x, double y) {
        const double each = 1 / (2 + std::abs(y - expected(x)));
        for (std::size_t i = 0; i < inputs; ++i) {
            const double part = each * x[i];
            for (std::size_t j = 0; j <= i; ++j) products_[i][j] += part * x[j];
            sums_[i] += part * y;
        }
        if (++seen_ < next_) return;
        next_ = seen_ + std::clamp(seen_ / 4, 16, 1024);
        solve();
        if (seen_ <= 4000) return;
        // Of late rather than long ago.
        for (auto& row : products_)
            for (double& n : row) n *= 0.8;
        for (double& n : sums_) n *= 0.8;
    }

private:
    void solve() {
        auto lower = products_;
        Inputs diagonal{}, y = sums_;
        for (std::size_t i = 0; i < inputs; ++i) {
            lower[i][i] += 50.0;  // nothing is known at first
            for (std::size_t j = 0; j <= i; ++j) {
                double left = lower[i][j];
                for (std::size_t k = 0; k < j; ++k) left -= lower[i][k] * lower[j][k] * diagonal[k];
                (j < i ? lower[i][j] : diagonal[i]) = j < i ? left / diagonal[j] : left;
            }
        }
        for (std::size_t i = 0; i < inputs; ++i)
            for (std::size_t k = 0; k < i; ++k) y[i] -= lower[i][k] * y[k];
        for (std::size_t i = 0; i < inputs; ++i) y[i] /= diagonal[i];
        for (std::size_t i = inputs; i-- > 0;)
            for (std::size_t k = i + 1; k < inputs; ++k) y[i] -= lower[k][i] * y[k];
        weight_ = y;
    }
    Inputs weight_{}, sums_{};
    std::array<Inputs, inputs> products_{};
    int seen_ = 0, next_ = 32;
};

/// A learner for each direction in which distances rise: along it they are as straight as the wall is far,
/// across it they bend as the wall does.
class Learners {
public:
    /// `rises`: differences to the next node along the axes over the width of a cell, -1 to 1 and a little.
    Learner& of(int level, const std::array<double, 3>& rises) {
        int direction = level;
        for (const double rise : rises)
            direction =
                direction * 5 + std::clamp(static_cast<int>(std::floor(2.49 * rise + 0.5)), -2, 2) + 2;
        return learners_[static_cast<std::size_t>(direction)];
    }

private:
    std::vector<Learner> learners_ = std::vector<Learner>(SheetField::level_count * 125);
};

struct Models {
    NumberModel count, step_x, step_y, step_z, start_y, start_z;
    std::array<BitModel, 8> same_row;
    std::array<BitModel, 8> same;
    BitModel same_as_finer;
    std::vector<NumberModel> residual = std::vector<NumberModel>(3 * 40);
};

[[noreturn]] void damaged() {
    throw std::runtime_error("packed distances are damaged");
}

class Packer {
public:
    Packer(RangeCoder& coder, std::size_t largest) : coder_(coder), left_(largest) {}

    BrickList bricks(const BrickList& given) {
        const std::int32_t told = coder_.number(models_.count, static_cast<std::int32_t>(given.size()));
        const auto count = static_cast<std::size_t>(told);
        constexpr std::size_t bytes =
            SplineGrid::node_count * sizeof(float) + 40;  // at least, with its place
        if (told < 0 || count > left_ / bytes) damaged();
        left_ -= count * bytes;
        BrickList all;
        Brick last{0, 0, 0};
        for (std::size_t b = 0; b < count; ++b) {
            const Brick brick = coder_.reads() ? last : given[b];
            Brick next = last;
            const bool row =
                coder_.bit(models_.same_row[0], brick[0] == last[0] && brick[1] == last[1] && b > 0);
            if (row) {
                next[2] = moved(last[2], models_.step_z, brick[2]);
            } else if (coder_.bit(models_.same_row[1], brick[0] == last[0] && b > 0)) {
                next[1] = moved(last[1], models_.step_y, brick[1]);
                next[2] = moved(row_start_, models_.start_z, brick[2]);
                row_start_ = next[2];
            } else {
                next[0] = moved(last[0], models_.step_x, brick[0]);
                next[1] = moved(slab_start_, models_.start_y, brick[1]);
                next[2] = moved(row_start_, models_.start_z, brick[2]);
                slab_start_ = next[1];
                row_start_ = next[2];
            }
            if (b > 0 && !(last < next)) damaged();
            all.push_back(last = next);
        }
        return all;
    }

    /// The same nodes elsewhere, for each brick: in a grid of another sheet, and in the eight bricks of the
    /// next finer grid; or null.
    struct Elsewhere {
        std::vector<const float*> earlier;
        std::vector<std::array<const float*, 8>> finer;
    };
    void values(SplineGrid& grid, int level, const Elsewhere& elsewhere) {
        struct Known {
            std::array<std::int32_t, SplineGrid::node_count> steps, off;  // off: the first prediction
            std::array<std::uint8_t, SplineGrid::node_count> width;       // of the residual, in bits
        };
        std::vector<Known> known(grid.bricks());
        const std::vector<std::array<std::int32_t, 8>> below = bricks_below(grid);
        std::array<std::int32_t, across * across * across> steps{}, off{};
        const double per_rise = value_step / grid.spacing();
        std::array<std::uint8_t, across * across * across> width{};
        int usual = 4;
        for (std::size_t b = 0; b < grid.bricks(); ++b) {
            unsigned there = 1;
            for (unsigned n = 1; n < 8; ++n) {
                const int from[3] = {n & 4 ? 0 : pad, n & 2 ? 0 : pad, n & 1 ? 0 : pad};
                const int to[3] = {n & 4 ? pad : across, n & 2 ? pad : across, n & 1 ? pad : across};
                const std::int32_t of = below[b][n];
                if (of >= 0) there |= 1u << n;
                for (int i = from[0]; i < to[0]; ++i)
                    for (int j = from[1]; j < to[1]; ++j)
                        for (int k = from[2]; k < to[2]; ++k) {
                            const auto to_node = static_cast<std::size_t>(at(i, j, k));
                            if (of < 0) {
                                width[to_node] = static_cast<std::uint8_t>(usual);
                                off[to_node] = 0;
                                continue;
                            }
                            const auto node = static_cast<std::size_t>(
                                (((i + 2) & 3) * side + ((j + 2) & 3)) * side + ((k + 2) & 3));
                            steps[to_node] = known[static_cast<std::size_t>(of)].steps[node];
                            off[to_node] = known[static_cast<std::size_t>(of)].off[node];
                            width[to_node] = known[static_cast<std::size_t>(of)].width[node];
                        }
            }
            const std::span<float> nodes = grid.nodes(b);
            int sames = 0, widths = 0;
            for (int node = 0; node < SplineGrid::node_count; ++node) {
                const int i = (node >> 4) + pad, j = (node >> 2 & 3) + pad, k = (node & 3) + pad;
                const auto here = static_cast<std::size_t>(at(i, j, k));
                std::int32_t value = coder_.reads() ? 0 : steps_of(nodes[static_cast<std::size_t>(node)]);
                const int around = width[static_cast<std::size_t>(at(i - 1, j, k))] +
                                   width[static_cast<std::size_t>(at(i, j - 1, k))] +
                                   width[static_cast<std::size_t>(at(i, j, k - 1))];
                bool same = false;
                if (elsewhere.earlier[b]) {
                    const std::int32_t other = steps_of(elsewhere.earlier[b][node]);
                    same = coder_.bit(models_.same[static_cast<std::size_t>(sames)], value == other);
                    sames = (sames << 1 | static_cast<int>(same)) & 7;
                    if (same) value = other;
                }
                const int octant = (node >> 3 & 4) | (node >> 2 & 2) | (node >> 1 & 1);
                const float* const finer = elsewhere.finer[b][static_cast<std::size_t>(octant)];
                if (!same && finer) {
                    // Twice its place within the octant.
                    const std::int32_t other =
                        steps_of(finer[(node >> 4 & 1) * 32 + (node >> 2 & 1) * 8 + (node & 1) * 2]);
                    same = coder_.bit(models_.same_as_finer, value == other);
                    if (same) value = other;
                }
                const Predictor& predictor = predictors()[static_cast<std::size_t>(choices_(there, node))];
                std::int64_t sum = 128;
                for (const Predictor::Term& t : predictor.terms)
                    sum += std::int64_t{t.weight} *
                           steps[static_cast<std::size_t>(at(i - t.i, j - t.j, k - t.k))];
                const auto first =
                    static_cast<std::int32_t>(std::clamp<std::int64_t>(sum >> 8, -most_steps, most_steps));
                std::int32_t expected = first;
                Learner* learner = nullptr;
                Learner::Inputs inputs{};
                if (choices_(there, node) < 2) {  // all of them are known
                    const auto below = [&](const auto& of, unsigned n) {
                        return of[static_cast<std::size_t>(at(i - static_cast<int>(n >> 2),
                                                              j - static_cast<int>(n >> 1 & 1),
                                                              k - static_cast<int>(n & 1)))];
                    };
                    const double corner = below(steps, 7);
                    learner = &learners_.of(
                        level, {per_rise * (below(steps, 3) - corner), per_rise * (below(steps, 5) - corner),
                                per_rise * (below(steps, 6) - corner)});
                    for (unsigned n = 1; n < 8; ++n) inputs[n - 1] = below(off, n);
                    const double better = std::floor(first + learner->expected(inputs) + 0.5);
                    if (std::abs(better) <= most_steps) expected = static_cast<std::int32_t>(better);
                }
                if (!same) {
                    const int context = std::min(39, around);
                    const std::size_t model = static_cast<std::size_t>(level * 40 + context);
                    const std::int64_t found =
                        std::int64_t{expected} + coder_.number(models_.residual[model], value - expected);
                    if (std::abs(found) > most_steps) damaged();
                    value = static_cast<std::int32_t>(found);
                }
                steps[here] = value;
                off[here] = value - first;
                if (learner) learner->learn(inputs, off[here]);
                width[here] = static_cast<std::uint8_t>(
                    std::bit_width(static_cast<std::uint32_t>(std::abs(value - expected))));
                widths += width[here];
                known[b].steps[static_cast<std::size_t>(node)] = value;
                known[b].off[static_cast<std::size_t>(node)] = off[here];
                known[b].width[static_cast<std::size_t>(node)] = width[here];
                if (coder_.reads())
                    nodes[static_cast<std::size_t>(node)] = static_cast<float>(value * value_step);
            }
            usual = (widths + SplineGrid::node_count / 2) / SplineGrid::node_count;
        }
    }

private:
    int moved(int from, NumberModel& model, int to) {
        const std::int64_t at = std::int64_t{from} + coder_.number(model, to - from);
        if (std::abs(at) > farthest) damaged();
        return static_cast<int>(at);
    }
    static std::int32_t steps_of(float value) {
        const double steps = value / value_step;
        if (!(std::abs(steps) <= most_steps) || steps != std::floor(steps))
            throw std::runtime_error("distances to be packed are no multiples of their step");
        return static_cast<std::int32_t>(steps);
    }
    /// Of each brick those below it; they come before it.
    static std::vector<std::array<std::int32_t, 8>> bricks_below(const SplineGrid& grid) {
        std::vector<std::array<std::int32_t, 8>> all(grid.bricks());
        for (unsigned n = 1; n < 8; ++n) {
            std::size_t next = 0;
            for (std::size_t b = 0; b < grid.bricks(); ++b) {
                const Brick& above = grid.brick(b);
                const Brick wanted{above[0] - static_cast<int>(n >> 2),
                                   above[1] - static_cast<int>(n >> 1 & 1),
                                   above[2] - static_cast<int>(n & 1)};
                while (next < grid.bricks() && grid.brick(next) < wanted) ++next;
                const bool there = next < grid.bricks() && grid.brick(next) == wanted;
                all[b][n] = there ? static_cast<std::int32_t>(next) : -1;
            }
        }
        return all;
    }

    RangeCoder& coder_;
    std::size_t left_;
    Models models_;
    Learners learners_;
    Choices choices_;
    int row_start_ = 0, slab_start_ = 0;
};

/// Both directions: `fields` is what is packed, or becomes what was.
void go_through(RangeCoder& coder, std::vector<SheetField>& fields, double spacing, std::size_t sheets,
                std::size_t largest) {
    constexpr std::size_t most_sheets = 100000;
    if (sheets > most_sheets) damaged();
    Packer packer(coder, largest);
    using Nodes = std::map<Brick, const float*>;
    std::array<Nodes, SheetField::level_count> seen;
    const auto in = [](const Nodes& nodes, const Brick& brick) {
        const auto found = nodes.find(brick);
        return found == nodes.end() ? nullptr : found->second;
    };
    for (std::size_t sheet = 0; sheet < sheets; ++sheet) {
        if (coder.reads()) fields.emplace_back();
        Nodes finer;
        for (int level = 0; level < SheetField::level_count; ++level) {
            const auto l = static_cast<std::size_t>(level);
            BrickList given;
            if (!coder.reads())
                for (std::size_t b = 0; b < fields[sheet].grids[l].bricks(); ++b)
                    given.push_back(fields[sheet].grids[l].brick(b));
            BrickList bricks = packer.bricks(given);
            Packer::Elsewhere elsewhere;
            for (const Brick& brick : bricks) {
                elsewhere.earlier.push_back(in(seen[l], brick));
                auto& octants = elsewhere.finer.emplace_back();
                for (int n = 0; n < 8 && level > 0; ++n)
                    octants[static_cast<std::size_t>(n)] =
                        in(finer,
                           {2 * brick[0] + (n >> 2), 2 * brick[1] + (n >> 1 & 1), 2 * brick[2] + (n & 1)});
            }
            if (coder.reads()) fields[sheet].grids.emplace_back(spacing * (1 << level), std::move(bricks));
            packer.values(fields[sheet].grids[l], level, elsewhere);
            finer.clear();
            for (std::size_t b = 0; b < fields[sheet].grids[l].bricks(); ++b)
                finer.emplace_hint(finer.end(), fields[sheet].grids[l].brick(b),
                                   fields[sheet].grids[l].nodes(b).data());
        }
        // Nodes stay where they are when a grid is moved.
        for (std::size_t l = 0; l < SheetField::level_count; ++l)
            for (std::size_t b = 0; b < fields[sheet].grids[l].bricks(); ++b)
                seen[l][fields[sheet].grids[l].brick(b)] = fields[sheet].grids[l].nodes(b).data();
    }
}

}  // namespace

std::string packed_values(const std::vector<SheetField>& fields) {
    RangeCoder coder;
    // Packing changes nothing.
    go_through(coder, const_cast<std::vector<SheetField>&>(fields), 0.0, fields.size(),
               std::numeric_limits<std::size_t>::max());
    return coder.take();
}

std::vector<SheetField> unpacked_values(std::span<const std::byte> packed, double spacing, std::size_t sheets,
                                        std::size_t largest) {
    RangeCoder coder(packed);
    std::vector<SheetField> fields;
    go_through(coder, fields, spacing, sheets, largest);
    return fields;
}

}  // namespace physics
