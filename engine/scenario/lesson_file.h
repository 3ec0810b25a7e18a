#pragma once
/// What a scenario file says for people: [lesson], its steps, views and other patients.

#include <string>

#include "engine/io/toml_section.h"
#include "engine/scenario/scenario.h"

namespace scenario {

void read_lesson(io::Section, Lesson&);

/// The patient of that number in the scenario's list, from 2 on, or "seed:17", drawn from a seed. Throws
/// InputError where there is none, or where no preset grows the vessels.
LessonPatient patient_of(const Scenario&, const std::string& word);

}  // namespace scenario
