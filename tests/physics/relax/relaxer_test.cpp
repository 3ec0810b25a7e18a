#include "physics/relax/relaxer.h"

#include <gtest/gtest.h>
#include <set>
#include <string>

namespace physics {

TEST(RelaxReport, AddsTheWorkAndKeepsTheLaterState) {
    RelaxReport sum, later;
    sum.updates = 10, sum.contacts = 4, sum.wall_queries = 7, sum.largest_turn = 0.3;
    sum.termination = Termination::StrictMinimum;
    later.updates = 5, later.contacts = 2, later.wall_queries = 1, later.largest_turn = 0.1, later.window = 9;
    later.termination = Termination::Stationary;
    sum.add(later);
    EXPECT_EQ(sum.updates, 15);
    EXPECT_EQ(sum.wall_queries, 8);
    EXPECT_EQ(sum.contacts, 2);
    EXPECT_EQ(sum.largest_turn, 0.3);
    EXPECT_EQ(sum.window, 9);
    EXPECT_FALSE(sum.converged());
    EXPECT_TRUE(sum.at_rest());
}

TEST(RelaxReport, EndsForOneReasonThatHasASentence) {
    RelaxReport report;
    std::set<std::string> sentences;
    for (const Termination end :
         {Termination::NotStarted, Termination::StrictMinimum, Termination::Stationary, Termination::Settled,
          Termination::OutOfBudget, Termination::Stuck}) {
        report.termination = end;
        EXPECT_TRUE(sentences.insert(message(end)).second) << message(end);
        EXPECT_LE(report.converged(), report.at_rest());
        EXPECT_FALSE(report.at_rest() && report.out_of_budget());
    }
    EXPECT_EQ(RelaxReport().termination, Termination::NotStarted);
}

}  // namespace physics
