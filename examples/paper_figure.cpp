/// The comparison that the paper rests on: how many cycles of relaxation its methods need. A wire of 60
/// segments is laid down the middle of a winding tube and relaxed by the first-order method (Eq. 22), which
/// never comes to rest on the wall, and by the second-order one with M = 1, 2 and 3 segments at a time
/// (Eqs. 26 to 34). The global Newton relaxer gives the energy of the equilibrium.

#include <cmath>
#include <cstdio>
#include <memory>

#include "physics/relax/relaxer.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

using namespace physics;

namespace {

double energy(const Chain& chain, const LumenWall& wall) {
    return total_energy(chain, all_contacts(chain, wall)).total();
}

}  // namespace

int main() {
    DeviceSpec spec;
    spec.outer_diameter = 0.8;
    spec.sections = {{0, 40, 40, 0, 0}};  // EI 40 N·mm² all along
    Polyline centreline;
    for (int x = 0; x <= 150; ++x)
        centreline.emplace_back(x, 8 * std::sin(x / 18.0), 6 * std::cos(x / 25.0) - 6);
    const TubeWall wall(centreline, 2, WallStiffness(2), spec.outer_diameter / 2);
    const Chain laid = wire_along(spec, Grid{2.0, EndCells::Paper}, centreline, 60);

    Chain rest = laid;
    make_relaxer(RelaxerConfig{}, wall)->relax(rest, {10'000'000, 0.75, 60});
    const double least = energy(rest, wall);
    std::printf("energy at the equilibrium: %.6f N mm\n", least);
    std::printf("above it after cycles:  1          2          4          8          16\n");
    struct Method {
        const char* name;
        RelaxerKind kind;
        int varied;
    };
    for (const Method& method : {Method{"first order, M = 1", RelaxerKind::FirstOrder, 1},
                                 Method{"second order, M = 1", RelaxerKind::Segment, 1},
                                 Method{"second order, M = 2", RelaxerKind::Segment, 2},
                                 Method{"second order, M = 3", RelaxerKind::Segment, 3}}) {
        RelaxerConfig config;
        config.kind = method.kind;
        config.varied_segments = method.varied;
        Chain chain = laid;
        const auto relaxer = make_relaxer(config, wall);
        std::printf("%-22s", method.name);
        for (int cycles = 0, until = 1; until <= 16; until *= 2) {
            relaxer->relax(chain, whole_cycles(chain.segments(), until - cycles));
            cycles = until;
            std::printf("  %.3e", std::max(0.0, energy(chain, wall) - least));
        }
        std::printf("\n");
    }
}
