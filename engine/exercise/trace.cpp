#include "engine/exercise/trace.h"

#include "engine/io/csv.h"

namespace exercise {
namespace {

/// The cells of a field's value.
struct Cells {
    const anatomy::Anatomy& anatomy;
    std::size_t device;  // of the row
    std::vector<io::CsvCell>& cells;

    void operator()(std::int64_t value) const { cells.emplace_back(static_cast<double>(value)); }
    void operator()(double value) const { cells.emplace_back(value); }
    void operator()(bool value) const { cells.emplace_back(value ? 1.0 : 0.0); }
    void operator()(const Place& place) const { cells.insert(cells.end(), place.begin(), place.end()); }
    void operator()(const InImage& place) const {
        cells.emplace_back(place.x);
        cells.emplace_back(place.y);
    }
    void operator()(const OfDevices& value) const { cells.emplace_back(value.of[device]); }
    void operator()(Branch branch) const { cells.emplace_back(name_of(branch, anatomy)); }
    void operator()(script::DeviceRole held) const { cells.emplace_back(std::string(script::name_of(held))); }
};

}  // namespace

std::string Trace::header() {
    std::vector<io::CsvCell> names;
    for (const Field& field : fields()) {
        if (field.column.empty()) continue;
        const std::size_t axis = field.column.find('?');
        for (const char name : std::string_view(axis == std::string_view::npos ? "?" : "xyz")) {
            std::string column(field.column);
            if (axis != std::string_view::npos) column[axis] = name;
            names.emplace_back(std::move(column));
        }
    }
    std::string text;
    io::append_row(text, names);
    return text;
}

std::string Trace::rows(const Frame& frame, const Score& score) const {
    std::string text;
    for (std::size_t k = 0; k < frame.simulation.devices().size(); ++k) text += row(k, frame, score);
    return text;
}

std::string Trace::row(std::size_t device, const Frame& frame, const Score& score) const {
    Observation reading = reader_.read(frame.simulation, frame.time, frame.simulation.devices()[device].role);
    reading.air_kerma = score.air_kerma.value_or(absent);
    if (reading.inserted.of[device] <= 0) {
        reading.tip = reading.direction = {absent, absent, absent};
        reading.along = reading.path_to_target = absent;
        reading.branch = Branch::None;
    }
    std::vector<io::CsvCell> cells;
    const Cells add{frame.simulation.anatomy(), device, cells};
    for (const Field& field : fields())
        if (!field.column.empty()) std::visit([&](const auto member) { add(reading.*member); }, field.member);
    std::string text;
    io::append_row(text, cells);
    return text;
}

}  // namespace exercise
