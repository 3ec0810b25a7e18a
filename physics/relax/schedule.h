#pragma once
/// Which segment is updated next.

#include "physics/relax/relaxer.h"

namespace physics {

/// Walks the segments first…N in the order of a relaxation cycle and remembers where it stopped, so that a
/// budget can end anywhere. A nested cycle visits segment b as often as its place in the window: distal ones
/// most.
class CycleWalk {
public:
    explicit CycleWalk(CycleOrder order) : order_(order) {}
    /// Next segment of the window [first, last]; `starts_sweep()` then reports whether a new sweep starts
    /// there.
    int next(int first, int last);
    bool starts_sweep() const { return starts_sweep_; }
    void state(StateStream& s) { s(sweep_, at_, starts_sweep_); }

private:
    CycleOrder order_;
    int sweep_ = 0, at_ = 0;  // counted from the window's first segment, so that it may move with the tip
    bool starts_sweep_ = false;
};

/// Two walks in proportion: one over the whole wire, one over the distal window that a trainee looks at.
class Schedule {
public:
    explicit Schedule(CycleOrder order) : whole_(order), distal_(order) {}
    struct Turn {
        int segment;
        bool starts_sweep;  // of the whole wire
    };
    Turn next(int segments, const RelaxBudget&);
    void state(StateStream& s) { s(whole_, distal_, owed_); }

private:
    CycleWalk whole_, distal_;
    double owed_ = 0;  // distal updates owed
};

}  // namespace physics
