#pragma once
/// What the panel around the image shows: numbers, and their text on screen.

#include <optional>
#include <string>
#include <vector>

namespace render {

enum class Notice { Info, Success, Warning, Alarm };

struct Message {
    std::string text;
    Notice notice = Notice::Info;
};

/// Position of the table.
struct TablePlace {
    double longitudinal = 0.0;  // toward the head [mm]
    double lateral = 0.0;       // toward the patient's left [mm]
    double height = 0.0;        // of its top above the floor [mm]
};

/// The marks on an image: how its own pulse was taken, whatever the stand has done since.
struct ImageMarks {
    std::string mode;                                      // FLUORO, DSA, ROADMAP
    double lao = 0.0, cranial = 0.0;                       // [rad]
    std::optional<double> pulse_rate, sid, field_of_view;  // [1/s], [mm]
    long frame = 0;
    std::optional<double> time;  // [s]
    /// Shift of the mask, to the right and down [pixels].
    double mask_x = 0.0, mask_y = 0.0;
};

/// One state of the panel. A value that is missing or not finite is shown as a dash.
struct Readout {
    std::string title;                // of the scenario
    std::string mode = "FLUORO";      // FLUORO, DSA, ROADMAP
    bool beam_on = false;             // otherwise the image is the last one held
    long frame = 0;                   // counted from 0
    std::optional<double> time;       // since the first frame [s]
    std::optional<ImageMarks> image;  // empty = the image shown belongs to this very state
    std::string reference_label;      // what the stored image is
    std::vector<Message> messages;    // oldest first; the last that fit are shown

    // C-arm and table
    double lao = 0.0;                     // RAO negative [rad]
    double cranial = 0.0;                 // caudal negative [rad]
    std::optional<double> sid;            // source to detector [mm]
    std::optional<double> sod;            // source to isocentre [mm]
    std::optional<double> field_of_view;  // side of the square field on the detector [mm]
    std::optional<TablePlace> table;

    // X-ray technique
    std::optional<double> pulse_rate;     // [1/s]
    std::optional<double> tube_voltage;   // [kV]
    std::optional<double> tube_current;   // [mA]
    std::optional<double> pulse_width;    // [ms]
    std::optional<double> detector_dose;  // per pulse [nGy]

    std::optional<double> breath_held;  // for so long [s]; empty while the patient breathes

    // Dose since the start
    std::optional<double> air_kerma;       // K_a,r at the patient entrance reference point [mGy]
    std::optional<double> air_kerma_rate;  // [mGy/min]
    std::optional<double> kerma_area;      // P_KA [Gy·cm²]
    std::optional<double> fluoro_time;     // beam-on time [s]

    /// A device and what a hand does to it and feels of it.
    struct Device {
        std::string name;                  // "wire", "catheter"
        std::optional<double> inserted;    // length beyond the introducer [mm]
        std::optional<double> length;      // that could be inserted [mm]
        std::optional<double> hub_twist;   // of the hub, right-handed about the advancing device [rad]
        std::optional<double> torque;      // at the introducer [N·mm]
        std::optional<double> push_force;  // along the device at the introducer [N]
        std::optional<double> grip = {};   // the hand's distance from the valve [mm]
        std::optional<double> bow = {};    // fed and not gone in: the shaft between bows [mm]
    };
    std::vector<Device> devices;  // innermost first
    // What the right hand, the left hand and a helper hold: the name of one, "all", for the helper names;
    // empty = nothing.
    std::string held, left_hand, helper;

    /// The balloon or the stent in use.
    struct Balloon {
        std::string title;
        std::optional<double> pressure, nominal, rated;  // [atm]; empty = a stent without a balloon
        std::optional<double> diameter, waist;           // the largest and the least now [mm]
        double seconds = 0;                              // of this inflation, or of the last [s]
        bool burst = false;
        std::optional<double> stent;  // its length; empty = none [mm]
        std::optional<double> out;    // of it, out of its sheath [mm]
        bool deployed = false;
        bool operator==(const Balloon&) const = default;
    };
    std::optional<Balloon> balloon;

    std::optional<double> tip_to_target;       // [mm]
    std::optional<double> tip_force;           // of the wall on the tip [N]
    std::optional<double> largest_wall_force;  // on any joint [N]
    double force_limit = 1.0;                  // force at which the bars are full [N]
    std::vector<double> force_history;         // largest wall force of the last seconds, oldest first [N]
    double history_length = 10.0;              // time span of the history [s]

    // Heart, and blood pressure by a transducer at the hub of a device
    std::optional<double> heart_rate;                                    // [1/min]
    std::string pressure_of;                                             // the device; empty = none
    std::optional<double> pressure, systolic, diastolic, mean_pressure;  // now, of a beat [mmHg]

    /// Of the last 4 s, oldest first, equally far apart in time; pressure is NaN where none was read.
    std::vector<double> pressure_history, ecg_history;  // [mmHg], [mV]

    // Contrast
    std::optional<double> contrast;        // given so far [ml]
    std::optional<double> contrast_limit;  // for the patient [ml]
    double injection_rate = 0.0;           // 0 while none is injected [ml/s]
};

/// The dose at which the operator is first notified (Stecker et al., J Vasc Interv Radiol 2009;20:S263).
struct DoseNotification {
    static constexpr double air_kerma = 3000.0;    // [mGy]
    static constexpr double kerma_area = 300.0;    // [Gy·cm²]
    static constexpr double fluoro_time = 1800.0;  // [s]
};

bool is_known(std::optional<double>);  // present and finite

/// The value with `decimals` digits after the point in any locale, "--" when not known.
std::string figure_text(std::optional<double> value, int decimals);

/// About three digits: "6.12", "41.7", "1620".
std::string dose_text(std::optional<double> value);
std::string centimetre_text(std::optional<double> length);  // [mm] to "110", "--"
std::string rate_text(std::optional<double> rate);          // pulses per second: "15", "7.5", "--"
std::string primary_angle_text(double lao);                 // [rad] to "LAO 30°", "RAO 12°", "LAO --"
std::string secondary_angle_text(double cranial);           // [rad] to "CRAN 10°", "CAUD 5°", "CRAN --"
/// "mask 1.3 right 0.4 down px", "" where both would be 0.0.
std::string mask_shift_text(double x, double y);
/// "8.0 atm (nominal 8, rated 14)", "burst".
std::string inflation_text(const Readout::Balloon&);
/// "6.0 mm, waist 4.1 mm".
std::string balloon_width_text(const Readout::Balloon&);
/// "12 of 18 mm out of its sheath", "on its balloon", "has left its balloon".
std::string stent_text(const Readout::Balloon&);
/// "118/79 (92)" of a beat, "--" when not known.
std::string pressure_text(const Readout&);
/// Upper end of the scale on which the curve of pressure is drawn [mmHg].
double pressure_scale(const Readout&);
/// Lower and upper end of that of the electrocardiogram [mV].
inline constexpr double ecg_low = -0.4, ecg_high = 1.1;
std::string clock_text(std::optional<double> time);  // [s] to "4:18" or "1:02:07", "--" when missing

/// Letters of the patient's directions at the edges of the image: R, L, A, P, H (head), F (feet), two where
/// the view is oblique, the dominant one first (DICOM 0020,0020). Empty when an angle is not finite.
struct ImageSides {
    std::string left, right, top;
};
ImageSides image_sides(double lao, double cranial);

}  // namespace render
