#pragma once

#include <mrpt/rtti/CObject.h>

#include <memory>
#include <string>

#include "etalon/core/parameters.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"

namespace etalon {

/** Version of the binary interface between host and plugins. Any change of the types below raises it. */
#define ETALON_INITIALIZER_ABI 1

inline namespace abi_v1 {

/**
 * Finds gravity, velocities and IMU biases from a window of keyframes: the interface of a plugin.
 *
 * Stateless but for its parameters: the same problem gives the same result, bit for bit. Expected refusals are results
 * with a status and a reason; exceptions are for broken configuration only.
 */
class Initializer : public mrpt::rtti::CObject {
  DEFINE_VIRTUAL_MRPT_OBJECT(Initializer)

 public:
  using Ptr = std::shared_ptr<Initializer>;

  /** Declares the parameters of the plugin's own INI section (the section is the plugin's name). */
  virtual void declareParameters(ParameterSet& parameters) = 0;

  /** Whether it uses InitializationProblem::visualSolution(). */
  virtual bool needsVisualSolution() const = 0;

  /**
   * Checks the problem (at least two keyframes, IMU covers the window without gaps, finite measurements), then calls
   * solve(). Never throws for a problem's sake: what solve() throws becomes a refusal.
   */
  InitializationResult initialize(const InitializationProblem& problem) const;

 protected:
  virtual InitializationResult solve(const InitializationProblem& problem) const = 0;
};

}  // namespace abi_v1

/** What a plugin library says of itself, as plain C, so that it can be read before anything else is trusted. */
struct InitializerDescriptor {
  int abi_version;
  const char* name;         ///< as the INI names it, e.g. "eta"
  const char* class_name;   ///< registered with mrpt::rtti
  const char* version;
  const char* description;  ///< one line
};

/** Symbol under which a plugin exports `extern "C" const InitializerDescriptor*()`. */
constexpr char kDescriptorSymbol[] = "etalon_initializer_descriptor";

}  // namespace etalon

/**
 * Stands once in a plugin's source, at global scope, and makes the class loadable:
 *   ETALON_REGISTER_INITIALIZER(EtaInitializer, etalon::plugins, "eta", "1.0", "one line")
 */
#define ETALON_REGISTER_INITIALIZER(CLASS, NAMESPACE, NAME, VERSION, DESCRIPTION)            \
  extern "C" __attribute__((visibility("default"))) const etalon::InitializerDescriptor*     \
  etalon_initializer_descriptor() {                                                          \
    static const etalon::InitializerDescriptor descriptor{                                   \
        ETALON_INITIALIZER_ABI, NAME, #NAMESPACE "::" #CLASS, VERSION, DESCRIPTION};         \
    return &descriptor;                                                                      \
  }                                                                                          \
  MRPT_INITIALIZER(etalon_register_##CLASS) {                                                \
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(CLASS, NAMESPACE));                         \
  }
