"""ROS node of the simulated rig: the lockstep's pace maker, or a drive on the steady clock."""

from __future__ import annotations

import time

from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter, LayoutError
from fjr_interface.experiment import Experiment, controller_from_json
from fjr_interface.health import OK, WARN, Health, Speed
from fjr_interface.parameters import ParameterGroup
from fjr_interface.real_time import LOCKSTEP, MODE_PARAMETER, NEVER, REAL_TIME, keep_pauses_out
from fjr_interface.ros import runtime, spinning
from fjr_interface.ros.program import Program
from fjr_interface.waiting import Lack
from fjr_kit.errors import InputError

from . import effects, plant
from .drive import faults, services
from .drive.control import SPEED, STEPS, SimulationControl, State
from .drive.control_services import ControlServices
from .drive.faulty_wire import wires
from .drive.lockstep import LockstepDrive
from .drive.real_time import TORQUE_TIMEOUT, RealTimeDrive
from .simulation import rig
from .simulation.simulator import SIMULATOR

PARAMETERS = ParameterGroup(
    *SIMULATOR,
    MODE_PARAMETER,
    SPEED,
    STEPS,
    TORQUE_TIMEOUT,
    *faults.PARAMETERS,
    runtime.JOINT_PARAMETER,
    runtime.readers_parameter("controller"),
)

_LOOK_SAMPLES = 100  # between two looks for subscribers of link_position


class SimulatorNode(runtime.RigNode):
    """Simulated drive: publishes y and /clock, holds the torque that answers, steps the plant.

    Each experiment description starts one realization: plant at rest, noise seeded anew, parameters
    read anew, time from one sample period. In lockstep a sample waits for the torque of the one
    before and for simulation control; in real time samples come by the steady clock.
    """

    def __init__(self) -> None:
        """Create publishers, subscriptions and the services of simulation control."""
        super().__init__("simulator", PARAMETERS)
        joint = self.values["joint"]
        self._encode = JointStateWriter("position", joint).encode
        self._decode = JointStateReader("effort").decode
        self.real_time = self.values["mode"] == REAL_TIME
        self.control = SimulationControl()
        self._experiment: Experiment | None = None
        self._lockstep: LockstepDrive | None = None
        self._drive: RealTimeDrive | None = None
        self._read_fault()
        self._running = self._publish_link = False
        self._controllers: frozenset[bytes] = frozenset()
        self.finished: str | None = None
        self._speed = Speed()
        self._ticks = self.create_publisher(Clock, "/clock", runtime.CLOCK_QOS)
        self._position = self.offer(topics.MOTOR_POSITION)
        self.claim(self._position)
        self._link = self.offer(topics.LINK_POSITION)
        on_torque = self._on_torque_in_real_time if self.real_time else self._on_torque
        self._torque = self.hear(topics.MOTOR_TORQUE, on_torque)
        self._description = self.create_subscription(
            String, topics.EXPERIMENT_TOPIC, self._on_experiment, runtime.EXPERIMENT_QOS
        )
        self.create_subscription(
            String, topics.CONTROLLER_TOPIC, self._on_controller, runtime.EXPERIMENT_QOS
        )
        self._restart = self.create_client(Trigger, "excitation/start")
        self._controls = ControlServices(self)
        services.offer(self, self._controls)
        self.values_changed()
        compiled = plant.coefficients(self.values), effects.coefficients(self.values)
        rig.hold(rig.at_rest(), 0.0, 1e-3, *compiled)  # compiles it

    def _on_controller(self, message: String) -> None:
        own = REAL_TIME if self.real_time else LOCKSTEP
        mode = controller_from_json(message.data).get(topics.MODE_KEY, own)
        if mode != own:
            raise InputError(
                f"The controller has mode {mode}, the simulator {own}; give both the same."
            )

    def _on_experiment(self, message: String) -> None:
        experiment = Experiment.from_json(message.data, "topic experiment")
        rate = self.values["sample_rate_hz"]
        if experiment.sample_rate_hz != rate:
            raise InputError(
                f"The experiment has sample_rate_hz {experiment.sample_rate_hz:g}, the simulator "
                f"{rate:g}; give both the same."
            )
        self.drop_run()
        self._experiment = experiment
        if self.real_time:
            self._drive = RealTimeDrive(self.values, experiment)
            self._in, self._out = wires(self._read_fault(), self.values["fault_seed"])
        else:
            self._lockstep = LockstepDrive(self.values, experiment)
        self.wait_until(self._lacking, self._begin)

    def _read_fault(self) -> faults.FaultPlan | None:
        plan = faults.FaultPlan.parse(self.values["fault"])
        if plan is not None and not self.real_time:
            raise InputError("fault is for mode realtime; a lockstep has none.")
        return plan

    def _lacking(self) -> Lack | None:
        if self.real_time and self.control.state == State.STOPPED:
            return Lack("play: the simulation is stopped", "`fjr play` lets it go on")
        return self.unread(self._position) or self.unwritten(self._torque, "controller")

    def _begin(self) -> None:
        self.get_logger().info(f"{self.run}.".capitalize())
        self._running = True
        self._controllers = self.writers("controller")
        self._look_for_link()
        if self._drive is None:
            self.go_on()
            return
        keep_pauses_out()
        self._drive.start(time.monotonic_ns())
        self.due_ns = self._drive.due_ns

    @property
    def run(self) -> str | None:
        """The realization under way and how far it is, in words; None without one.

        A sample that waits for its torque counts, as no pause can hold it back any more.
        """
        experiment, drive = self._experiment, self._drive or self._lockstep
        if experiment is None or drive is None:
            return None
        begun = drive.samples + bool(self._lockstep and self._lockstep.stamp)
        return (
            f"level {experiment.level}, realization {experiment.realization}: {begun} of "
            f"{drive.total} samples"
        )

    def drop_run(self) -> None:
        """Give the realization under way up: plant at rest, nothing published."""
        self.stop_waiting()
        self._running, self._experiment, self.finished = False, None, None
        self._lockstep = self._drive = None
        self.due_ns = NEVER

    def start_anew(self) -> None:
        """Ask the excitation for its realization from the beginning."""
        if not self._restart.service_is_ready():
            raise InputError(
                f"Nobody offers {self._restart.srv_name}; start the excitation node first."
            )
        self._restart.call_async(Trigger.Request())

    def values_changed(self) -> None:
        """Go on at the speed that is set now."""
        self.control.set_speed(self.values["speed"])
        self.go_on()

    def go_on(self) -> None:
        """Play the next sample of a lockstep if it may be played now; else wait until it may."""
        drive = self._lockstep
        if not self._running or drive is None or drive.stamp:
            return
        now_ns = time.monotonic_ns()
        self.due_ns = self.control.next_ns(now_ns, drive.next_stamp)
        if self.due_ns <= now_ns:
            self.due_ns = NEVER
            self._publish_sample(drive)

    def _publish_sample(self, drive: LockstepDrive) -> None:
        self.control.begin_sample()
        position = drive.measure()
        self._publish_position(drive.stamp, position)
        if drive.samples % _LOOK_SAMPLES == 0:
            self._look_for_link()
        if self._publish_link:
            self._link.publish(self._encode(drive.stamp, drive.link))

    def _look_for_link(self) -> None:
        heard = self._link.get_subscription_count() > 0
        self._publish_link = heard or self.values["link_encoder"]

    def _publish_position(self, stamp: int, position: float) -> None:
        self._position.publish(self._encode(stamp, position))
        self._ticks.publish(topics.clock_message(stamp))

    def _on_torque(self, message: bytes) -> None:
        stamp, torque = self._decoded(message)
        drive = self._lockstep
        if drive is None or stamp != drive.stamp:
            return  # a late answer to a run that was replaced
        drive.hold(torque)
        if self.control.free and not drive.over:
            self._publish_sample(drive)
            return
        if drive.over:
            self._finish(drive)
        if drive.over or not self.control.stepping:
            self._controls.steps_over(done=not self.control.stepping)
        self.go_on()

    def _decoded(self, message: bytes) -> tuple[int, float]:
        try:
            return self._decode(message)
        except LayoutError as error:
            raise InputError(f"Topic motor_torque: {error}; publish one effort.") from None

    def _on_torque_in_real_time(self, message: bytes) -> None:
        if self._drive is not None:
            now_ns = time.monotonic_ns()
            self._in.put(now_ns, *self._decoded(message))
            self.on_time(now_ns)

    def on_time(self, now_ns: int) -> None:
        """Play what is due: a sample of the lockstep, or whatever the drive in real time has."""
        if (drive := self._drive) is None:
            self.go_on()
            return
        for stamp, position, link in drive.measure(now_ns):
            self._out.put(now_ns, stamp, position)
            if self._publish_link:
                self._link.publish(self._encode(stamp, link))
        for stamp, position in self._out.take(now_ns):
            self._publish_position(stamp, position)
        for stamp, torque in self._in.take(now_ns):
            drive.command(now_ns, stamp, torque)
        self.due_ns = min(drive.due_ns, self._in.next_ns, self._out.next_ns)
        if drive.over and self.due_ns == NEVER:
            self._finish(drive)

    def _finish(self, drive: LockstepDrive | RealTimeDrive) -> None:
        experiment = self._experiment
        assert experiment is not None  # a drive plays one
        self.drop_run()
        self.finished = (
            f"finished level {experiment.level}, realization {experiment.realization} "
            f"({experiment.realization + 1} of {experiment.realizations})"
        )
        self.get_logger().info(f"{self.finished}: {drive.describe()}".capitalize())

    def health(self) -> Health:
        """Return speed, sticking and, in real time, the lateness of the run."""
        drive = self._drive or self._lockstep
        figures = {} if drive is None else drive.figures()
        bad = self._drive is not None and self._drive.troubled
        speed = self._speed.look(drive.samples if drive else 0, self.values["sample_rate_hz"])
        values = {"mode": self.values["mode"], "speed (x real time)": speed, **figures}
        return Health(WARN if bad else OK, self._controls.status(), values)

    def owed(self) -> Lack | None:
        """Return the torque that the simulated drive waits for, or before its first run this."""
        drive = self._lockstep
        if drive is not None and drive.stamp:
            torque = f"the torque of {drive.stamp * 1e-9:.6f} s"
            return self.overdue(torque, "controller", self._controllers)
        if self._experiment or self.finished or self.control.state == State.STOPPED:
            return None
        return self.unwritten(self._description, "excitation") or Lack(
            f"an experiment on {self._description.topic_name}",
            "the excitation says what it waits for; if nothing, `fjr reset` starts it",
        )


def main() -> int:
    """Run the node; the console script `fjr_sim_node`."""
    return spinning.run(
        SimulatorNode, program=Program("fjr_sim_node", SimulatorNode.__doc__, PARAMETERS)
    )
