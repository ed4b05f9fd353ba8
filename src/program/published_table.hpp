// Table I of the paper: its own and quoted scores on SemanticKITTI.
#pragma once

#include <array>
#include <cstddef>

namespace dynains::program {

struct PublishedRow {
  const char* sequence;
  const char* method;
  double pr;  ///< %
  double rr;  ///< %
  double f1;
};

struct PublishedWindow {
  const char* sequence;
  std::size_t start;  ///< scan numbers, inclusive
  std::size_t end;
};

inline constexpr std::array<PublishedWindow, 5> kPublishedWindows = {
    {{"00", 4390, 4530}, {"01", 150, 250}, {"02", 860, 950}, {"05", 2350, 2670}, {"07", 630, 820}}};

inline constexpr std::array<PublishedRow, 30> kPublishedRows = {{
    {"00", "OctoMap", 34.568, 99.979, 0.514},
    {"00", "Removert", 85.502, 99.354, 0.919},
    {"00", "ERASOR", 93.980, 97.081, 0.955},
    {"00", "DynamicFilter", 90.070, 91.090, 0.906},
    {"00", "paper, IOC only", 97.973, 97.540, 0.977},
    {"00", "paper, full", 98.067, 96.679, 0.974},
    {"01", "OctoMap", 20.777, 99.863, 0.344},
    {"01", "Removert", 94.221, 93.608, 0.939},
    {"01", "ERASOR", 91.487, 95.383, 0.934},
    {"01", "DynamicFilter", 87.950, 87.690, 0.878},
    {"01", "paper, IOC only", 89.498, 84.663, 0.870},
    {"01", "paper, full", 99.262, 87.188, 0.928},
    {"02", "OctoMap", 23.746, 99.792, 0.384},
    {"02", "Removert", 76.319, 96.799, 0.853},
    {"02", "ERASOR", 87.731, 97.008, 0.921},
    {"02", "DynamicFilter", 88.020, 86.100, 0.871},
    {"02", "paper, IOC only", 99.015, 98.672, 0.988},
    {"02", "paper, full", 99.085, 98.716, 0.989},
    {"05", "OctoMap", 33.904, 99.882, 0.506},
    {"05", "Removert", 86.900, 87.880, 0.874},
    {"05", "ERASOR", 88.730, 98.262, 0.933},
    {"05", "DynamicFilter", 90.170, 84.650, 0.873},
    {"05", "paper, IOC only", 97.909, 96.373, 0.971},
    {"05", "paper, full", 98.021, 96.015, 0.970},
    {"07", "OctoMap", 38.183, 99.565, 0.552},
    {"07", "Removert", 80.689, 98.822, 0.888},
    {"07", "ERASOR", 90.624, 99.271, 0.948},
    {"07", "DynamicFilter", 87.940, 86.800, 0.874},
    {"07", "paper, IOC only", 92.084, 95.187, 0.936},
    {"07", "paper, full", 92.165, 95.187, 0.936},
}};

}  // namespace dynains::program
