"""Settings of the residual diagnosis: every number that decides, each with its reason."""


# ---- chance ----------------------------------------------------------------------------------------------------------

#: Probability of accepting any effect by chance, shared among all candidates that are tried.
FALSE_ALARM_LEVEL = 0.01
#: One-sided 95 % quantile of the normal distribution: what is worse by less is worse by chance.
NORMAL_95_ONE_SIDED = 1.6448536269514722
#: Parameters that move by more of their stated uncertainties are reported, and no effect may drive one so far.
FAR = 3.0

# ---- shares of a mean square -----------------------------------------------------------------------------------------

#: Share of a signal below which neither a residual nor an instrument's error means anything: links are cut into pieces
#: and gauges calibrated to no better.
NEGLIGIBLE = 0.005
#: An effect that does less than this share of what was measured is none: no law is as exact, nor a lever or a ratio.
SLIGHT = 0.003
#: Gain below which a change is none, also one by shifted samples.
LEAST_GAIN = 0.02
#: Gain that a second description of the same thing has to add to a simpler one.
CLEARLY = 0.05
#: Gain that is worth a name: what sticks and creeps leaves less than that to imitate.
WORTH_A_NAME = 0.1
#: Below this gain most of the residual is something else, which an effect might merely imitate: the evidence then has
#: to be this many times as strong.
MODEST_GAIN, MODEST_FACTOR = 0.3, 3.0
#: From this gain on an effect does most of the work.
CLEAR_GAIN = 0.5
#: Evaluations of a refit with a spring where links bend already: each is a simulation, and a spring that is there gains
#: most in the first.
FEW_EVALUATIONS = 6

# ---- fits ------------------------------------------------------------------------------------------------------------

#: A fit stops when the sum of squares changes by less than this share: far below what a verdict rests on.
TOLERANCE = 1e-6
#: Share of each record that is kept out of the fit when no validation record is given.
HELD_OUT = 0.3
#: Validation records that make the range of a command or a joint so many times as wide show what training ones cannot.
WIDER = 2.0
#: Stated uncertainties, on a logarithmic scale, that a recalibration may move what the model is not linear in.
REACH = 4.0
#: The motion is filtered at most so many times as high as the least error of its acceleration asks for.
QUICKER = 4.0

# ---- noise and structure ---------------------------------------------------------------------------------------------

#: A residual within this factor of the noise floor has nothing left to explain, unless it repeats.
FLOOR_FACTOR = 1.3
#: Share of the frequencies of a residual that hold no more than noise, for the estimate of what is white in it.
QUIET_SHARE = 0.4
#: A residual of so many times its white part is not white. Strains and other signs of hidden motion integrate noise,
#: which raises them about so much.
ABOVE_WHITE, DRIFTING = 1.6, 1.5
#: Validation records with so many times the relative error of the training records hold something new.
NEW = 4.0
#: Standard deviations of a rank correlation from which the residual grows with the effort, and of how many samples one
#: is taken for independent.
GROWING, THINNED = 4.0, 2
#: Seed of drawn noise; any would do. Most draws, and numbers of noise that tell its size to a twentieth.
SEED, DRAWS, ENOUGH = 20160331, 6, 200
#: Noise of commands that is sent through drives, as a share of these; share of the band over which its spectrum is
#: smoothed; share by which parameters of drives may differ for the same one.
COMMAND_NOISE, SMOOTHED, NEAR = 0.01, 0.08, 0.05
#: Places of a record, and frequencies, at which a linear model tells what a machine makes of a command.
PLACES, GRID = 5, 200
#: Change of a reading that is rounding, in steps between numbers of its size; steps of the coarsest converters, 8 bits.
ROUNDING, STEPS = 8.0, 256

# ---- what is left ----------------------------------------------------------------------------------------------------

#: Parts of each training record, of which each is predicted from the others, and most terms of a formula.
FOLDS, MOST_TERMS = 5, 5
#: Share of the predicted mean square that a term has to take, and of its length that is its own.
TERM_GAIN = 0.03
#: Transition velocity of dry terms as shares of the largest speed, where no friction of the model has one.
TRANSITION_SHARES = (0.002, 0.01, 0.04)
#: Longest period that is looked for, in multiples of the travel, and factor by which a fit may move one.
LONGEST_PERIOD, PERIOD_RANGE = 1.5, 1.15
#: Share of the power of the efforts that lies in the band in which the remainder is compared.
EFFORT_SHARE = 0.99
#: Bins of a state, and pull of each towards zero, in samples of a bin that all alike would fill; most states named.
BINS, PULL, MOST_NAMED = 10, 0.02, 4
#: Fewest periods of a disturbance in a record.
FEWEST_PERIODS = 3.0
#: Bins of a state that an effect is drawn over, and samples that the curve of its law keeps.
PICTURE_BINS, LAW_SAMPLES = 40, 3000
#: Most samples in which periods are looked for.
MOST_SAMPLES = 4000

# ---- start values ----------------------------------------------------------------------------------------------------

#: Share of the largest influence on a residual below which that of a parameter is rounding.
ROUNDED = 1e-12
#: Deviations of its sensor's noise that the way of a coordinate at rest spans: four to either side.
WITHIN_NOISE = 8.0
#: Effort, speed and way of what stands, in SI units.
LEAST = 1e-9
#: Start periods that are proposed.
PERIODS = 3
#: Most waves on the whole way that all samples are asked for.
MOST_WAVES = 400.0
#: Cells of the way in the shortest wave of an octave, for a twentieth of its power; waves in one more on the whole way;
#: share of a wave that a slow sample may pass until the next one, and fewest of them: a wave has two sizes and is told
#: from a mean.
CELLS, FINER, PASSED, SLOWEST = 8, 4, 0.4, 16
#: Places of a stop, or limits of a drive, that are compared; fewest samples beyond one; largest share of them beyond a
#: stop and beyond a limit.
COMPARED, BEYOND_LEAST, BEYOND_MOST, LIMITED_MOST = 30, 3, 0.3, 0.5
#: Places of a stop, as shares of the half travel from its middle.
STOP_SHARES = (0.6, 0.8, 0.95)
#: Frequencies at which a spring lets the link swing behind a motor that stands still, Hz, and damping ratio there.
FREQUENCIES, LOOSE = (3.0, 8.0, 20.0, 50.0), 0.05
#: Slowest of these in a fit, Hz: a softer spring holds nothing. Least inertia on the side of the drive, as a share.
SOFTEST, LEAST_DRIVEN = 0.5, 1e-4
#: Frequency of the contacts of backlash, Hz, damping ratio, and widths as shares of the half travel.
CONTACT_FREQUENCY, CONTACT, GAP_SHARES = 50.0, 0.1, (5e-4, 3e-3, 1.5e-2)
#: Gaps as shares of half the way of a deflection that is read: it is the gap and what the spring gives way beside it.
SHARES_OF_DEFLECTION = (0.05, 0.3, 1.0)

# ---- discriminating experiments --------------------------------------------------------------------------------------

#: Longest experiment, s, and most samples of one.
LONGEST_EXPERIMENT, EXPERIMENT_SAMPLES = 60.0, 20000
#: Share of the range seen that is used, so that a controller's overshoot stays within it.
RANGE_SHARE = 0.9
#: Speeds of trapezoids as shares of the largest one seen, the slow ones to creep through the reversal; amplitudes of
#: chirps and multisines as shares of half the range, and their duration or period, s.
SPEEDS, AMPLITUDES, DURATION = (1.0, 0.3, 0.05, 0.01), (1.0, 0.3, 0.05), 20.0
