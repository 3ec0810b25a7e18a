#pragma once
/// A plan: for each set of devices a course that reaches the target, or why none was found; ranked.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/plan/case.h"
#include "engine/plan/judge.h"
#include "engine/plan/risks.h"
#include "engine/plan/search.h"

namespace plan {

/// What was found out about one candidate. All of it is kept in its file.
struct Planned : Worth {
    std::string name;      // of the candidate; "own"
    std::string identity;  // of case, devices, options and program: what was made is not made again
    std::vector<std::string> devices;               // "wire: 0.035 in hydrophilic nitinol, angled"
    std::string scenario;                           // TOML, with files by their whole path
    std::string settings;                           // "seed 1, 40000 frames a search, 2 restarts"
    std::string refused;                            // why no exercise could begin; empty: one did
    bool reached = false;                           // and the rest of what follows is of the best course
    bool within_limits = true;                      // of force and turns
    bool stopped = false;                           // time was up: the best so far
    std::string course;                             // script; of the nearest where the target was not reached
    double left = 0;                                // of the way to the target, of the nearest state [mm]
    double impulse = 0, travel = 0;                 // [N·s], [mm]
    std::optional<double> air_kerma, area_product;  // [mGy], [Gy·cm²]
    double contrast = 0;                            // [ml]
    std::optional<double> tip_error, force_error;   // at the end, as Judged has them [mm], [N]
    exercise::ModelErrors model_errors;             // likewise
    std::vector<std::string> left_out;              // likewise
    int handling_errors = 0;
    int exchanges = 0;                   // of the wire
    std::vector<std::string> not_tried;  // of what was asked for, a sentence each
    std::vector<std::string> defects;
    std::vector<Moment> moments;
    std::vector<Failure> failures;
    std::vector<Sensitivity> sensitivities;  // of the first of all
    long frames = 0;                         // simulated by the search
    std::size_t states = 0, courses = 0;     // kept; that reached the target
};

/// The better first: courses that reach the target within the limits, as Worth orders them; those beyond a
/// limit; those that do not reach, the nearer first; those that could not begin.
void rank(std::vector<Planned>&);

struct PlanOptions {
    SearchOptions search;  // of whose wires those are tried that fit the candidate
    room::Speeds speeds;
    anatomy::ModelCache cache;
    std::filesystem::path catalogue;
    std::string program;               // version and hash, of the identity
    std::optional<double> most_force;  // on the wall, of one joint [N]
    std::optional<int> most_turns;
    std::function<void(double part, const std::string& doing)> progress;
    std::function<bool()> stop;        // interrupted: throws Stopped
    std::function<bool()> time_is_up;  // ends a search with the best so far
};
struct Stopped {};

/// Plans one candidate. Throws InputError for a text that is no scenario, a target that no way leads to and a
/// patient that cannot be imaged, and Stopped; why the exercise cannot begin with these devices is in
/// `refused`.
Planned plan(const CaseText&, const Candidate&, const PlanOptions&);

/// Of the first of a ranked list, unless it has them or does not reach.
void add_sensitivities(std::vector<Planned>&, const PlanOptions&);

std::string identity_of(const CaseText&, const Candidate&, const PlanOptions&);

/// As JSON and back. Throws InputError for a text that is none, with the file's name.
std::string to_json(const Planned&);
Planned planned_from(const std::string& json, const std::string& file);

/// A row for each.
std::string to_csv(const std::vector<Planned>&);
/// All but the files of each.
std::string plan_json(const std::vector<Planned>&, const std::string& program);

}  // namespace plan
