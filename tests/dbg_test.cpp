#include <gtest/gtest.h>
#include "engine/exercise/exercise.h"
#include "tests/engine/exercise/treated.h"
#include "physics/wire/energy.h"
#include <cstdio>
using namespace exercise;
TEST(Dbg, A) {
    auto dev=test::balloon_catheter(false);
    if(getenv("NOF")) dev.friction=dev.static_friction=dev.inner_friction=dev.static_inner_friction=dev.valve_friction=dev.static_valve_friction=0;
    if(getenv("NOR")) dev.balloon->rigidity=0;
    Exercise exercise(test::scenario_to_treat(dev), false);
    std::vector<script::Command> c{script::Inflate{10}};
    for (int k = 0; k < 120; ++k) {
        const Frame f = exercise.next_frame(c); c.clear();
        const auto& t = exercise.simulation().treatment();
        const auto& r = t.inflation()->radii;
        const auto& pl=t.lesions()[0].places;
        auto m=std::ranges::min_element(pl,{},&physics::OpenedPlace::radius);
        printf("%d P %.2f rmax %.3f rmin %.3f les %.3f set %.3f contact %.2f rest %d settling %d upd %d grad %.2e\n", k, t.inflation()->pressure, r.empty()?0:*std::ranges::max_element(r), r.empty()?0:*std::min_element(r.begin()+4,r.end()-4), m->radius, m->set, m->contact, exercise.simulation().readings().at_rest, f.motion.settling, f.motion.relax.updates, f.motion.relax.gradient);
    }
    const auto& w=exercise.simulation().wire(); const auto& cc=exercise.simulation().contacts();
    double s=0; for (std::size_t j=0;j<w.joints.size();++j){ if(j) s+=w.lengths[j]; printf("j %zu s %.2f thick %.3f pen %.4f n %.2f EI %.0f y %.3f\n", j,s,w.thickness[j],cc[j].penetration,cc[j].normal.norm(),w.rigidity[j],w.joints[j].y()); }
}
