#include "engine/studies/rivals/rival.h"

#include <algorithm>
#include <stdexcept>

namespace rivals {

void Rival::take(const std::vector<Vec3>& nodes) {
    if (nodes.size() < 2) throw std::invalid_argument("a rod needs at least two nodes");
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (!nodes[i].allFinite())
            throw std::invalid_argument("node " + std::to_string(i) + " of the rod is not finite");
    nodes_ = nodes;
    ways_.assign(nodes.size(), 0.0);
    tally_ = {};
    diverged_ = false;
    still_ = 0;
    if (tube_)
        for (std::size_t i = 0; i < nodes.size(); ++i) ways_[i] = tube_->nearest_way(nodes[i]);
}

double Rival::wall_energy() const {
    double energy = -spec_.load.dot(nodes_.back() - spec_.base);
    if (!tube_) return energy;
    for (int i = 1; i <= segments(); ++i) {
        double way = ways_[i];
        const double depth = std::max(0.0, tube_->touch(nodes_[i], way, false).depth);
        energy += 0.5 * wall_stiffness(i) * depth * depth;
    }
    return energy;
}

bool Rival::lost() const {
    const double far = 2 * segments() * spec_.segment_length;
    return std::any_of(nodes_.begin(), nodes_.end(), [&](const Vec3& x) {
        return !((x - spec_.base).squaredNorm() <= far * far);  // true for what is not a number
    });
}

}  // namespace rivals
