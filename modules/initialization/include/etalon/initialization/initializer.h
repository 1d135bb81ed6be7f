#pragma once

#include <mrpt/rtti/CObject.h>

#include <memory>
#include <string>
#include <type_traits>

#include "etalon/core/parameters.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"

namespace etalon {

/** Version of the binary interface between host and plugins. Any change of the types below, or of
 * what they are made of (InitializationProblem::Data and what is in it), raises it. */
#define ETALON_INITIALIZER_ABI 8

/** Namespace of the interface, abi_v<version>: a plugin of another version does not even link. */
#define ETALON_INITIALIZER_NAMESPACE ETALON_ABI_NAMESPACE(ETALON_INITIALIZER_ABI)
#define ETALON_ABI_NAMESPACE(VERSION) ETALON_ABI_NAMESPACE_OF(VERSION)
#define ETALON_ABI_NAMESPACE_OF(VERSION) abi_v##VERSION

inline namespace ETALON_INITIALIZER_NAMESPACE {

/**
 * Finds gravity, velocities and IMU biases from a window of keyframes: the interface of a plugin.
 *
 * Stateless but for its parameters: the same problem gives the same result, bit for bit. Expected
 * refusals are results with a status and a reason; exceptions are for broken configuration only.
 */
class Initializer : public mrpt::rtti::CObject {
  DEFINE_VIRTUAL_MRPT_OBJECT(Initializer)

 public:
  /** Declares the parameters of the plugin's own INI section (the section is the plugin's name). */
  virtual void declareParameters(ParameterSet& parameters) = 0;

  /** Whether it uses InitializationProblem::visualSolution(). */
  virtual bool needsVisualSolution() const = 0;

  /**
   * Checks the problem (at least two keyframes, frames in order, finite measurements, IMU covering
   * the window with no step longer than longestImuStep()), calls solve(), and checks what it calls
   * a success (one finite state a keyframe). Never throws for a problem's sake: what solve() throws
   * becomes a refusal.
   */
  InitializationResult initialize(const InitializationProblem& problem) const;

 protected:
  virtual InitializationResult solve(const InitializationProblem& problem) const = 0;
};

}  // namespace ETALON_INITIALIZER_NAMESPACE

/** What a plugin library says of itself, as plain C, so that it can be read before anything else is
 * trusted: abi_version first, the rest only if that is ETALON_INITIALIZER_ABI. */
struct InitializerDescriptor {
  int abi_version;
  const char* name;        ///< as the INI names it, e.g. "eta": a-z, 0-9, '_'
  const char* class_name;  ///< registered with mrpt::rtti
  const char* version;
  const char* description;  ///< one line
};

/** Symbol under which a plugin exports `extern "C" const InitializerDescriptor*()`. */
constexpr char kDescriptorSymbol[] = "etalon_initializer_descriptor";

/**
 * Registers a class with mrpt::rtti unless another one already has its name (MRPT alone would
 * replace that one silently); PluginLoader finds out and says so.
 */
void registerInitializerClass(const mrpt::rtti::TRuntimeClassId* class_id);

}  // namespace etalon

/**
 * Stands once in a plugin's source, after IMPLEMENTS_MRPT_OBJECT of the class, at global scope and
 * without semicolon, and makes the class loadable:
 *   ETALON_REGISTER_INITIALIZER(EtaInitializer, etalon::plugins, "eta", "1.0", "one line")
 * The class has DEFINE_MRPT_OBJECT(EtaInitializer, etalon::plugins) inside, and inside its
 * namespace stands IMPLEMENTS_MRPT_OBJECT(EtaInitializer, etalon::Initializer, etalon::plugins).
 */
#define ETALON_REGISTER_INITIALIZER(CLASS, NAMESPACE, NAME, VERSION, DESCRIPTION)           \
  static_assert(std::is_base_of_v<etalon::Initializer, NAMESPACE::CLASS>,                   \
                #CLASS " must derive from etalon::Initializer");                            \
  static_assert(!std::is_abstract_v<NAMESPACE::CLASS>,                                      \
                #CLASS " must implement declareParameters, needsVisualSolution and solve"); \
  extern "C" __attribute__((visibility("default"))) const etalon::InitializerDescriptor*    \
  etalon_initializer_descriptor() {                                                         \
    static const etalon::InitializerDescriptor kDescriptor{                                 \
        ETALON_INITIALIZER_ABI, NAME, #NAMESPACE "::" #CLASS, VERSION, DESCRIPTION};        \
    return &kDescriptor;                                                                    \
  }                                                                                         \
  namespace {                                                                               \
  [[maybe_unused]] const bool kEtalonInitializerRegistered =                                \
      (etalon::registerInitializerClass(CLASS_ID_NAMESPACE(CLASS, NAMESPACE)), true);       \
  }
