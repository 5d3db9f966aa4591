"""A robot of a team without a master: the same robot as ever, with its own word for a server's.

The robot's software (`robot_agent.agent`) speaks to a server. Here that is the robot itself: what
it would send is answered from what all robots share. So mapping, bidding and driving are the same,
whoever decides. What the others say comes by radio: observations, poses, and where they are.

Source: Pfingsthorn et al. 2007, section 2.
"""

from __future__ import annotations

from collections.abc import Callable

from coordination.strategy import Strategy
from protocol import messages as words
from protocol.codec import Header
from protocol.effects import Effect, Event, Note, Received, Rejected, Send
from protocol.log.messages import LogHave, LogWant, Observations, PoseSet
from protocol.messages import EVERYONE, SERVER, WORLD, Message
from protocol.peer_messages import Beacon, LastHeard, Lookout
from protocol.world_messages import Joined, Through
from robot_agent.agent import Agent
from robot_agent.decentral.beaconing import Beaconing
from robot_agent.decentral.choosing import Choosing
from robot_agent.decentral.memory import Memory
from robot_agent.decentral.settings import PeerSettings
from robot_agent.decentral.sharing import Sharing
from robot_agent.decentral.tying import Standing

_JUST_NOW = 3.0  # [s]; whoever was heard since is about where it said
_SEVERAL = 2  # it and one other
_LOG = (Observations, PoseSet, LogHave, LogWant)


class Peer:
    """The core of a robot that needs no server.

    Args:
        agent: the robot's software.
        settings: how it shares and decides.
        strategy: ranks the places it could go to.
        sharing: its copy of the team's observations.
        life: which start of the robot's software this is.

    Attributes:
        now: mission time as of its last event [s].
    """

    def __init__(
        self,
        agent: Agent,
        settings: PeerSettings,
        strategy: Strategy,
        sharing: Sharing,
        life: int = 0,
    ) -> None:
        self.agent = agent
        self.life = life
        self.now = 0.0
        self.name = agent.name
        self.sharing = sharing
        self.choosing = Choosing(agent, strategy, settings.decision)
        self._beaconing = Beaconing(settings)
        self._said = Through(through=False, held=0)
        self._answers: dict[type[Message], Callable[[Message, float], list[Effect]]] = {
            words.Hello: self._hello,
            words.Heartbeat: self._heartbeat,
            words.ScanReport: self._report,
            words.Bid: self._bid,
            words.TaskProgress: self._task_progress,
            words.TaskEnd: self._task_end,
            words.TightPlace: self._tight_place,
            words.MapRequest: self._map_request,
        }

    # --- the core's three methods -----------------------------------------------------------

    def next_deadline(self) -> float | None:
        """Return when something is due next [s]."""
        due = [self.agent.next_deadline(), self.sharing.next_deadline(), self.choosing.due]
        return min(at for at in due if at is not None)

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take a body frame, a question of the world's, or a teammate's word."""
        self.now = now
        if isinstance(event, Rejected) and event.channel == "radio":
            return self.sharing.fault(event.source, event.reason, now)
        if not isinstance(event, Received):
            return self._carry_out(self.agent.handle(event, now), now)
        if event.channel == "radio":
            return self._hear(event.header, event.message, now)
        if isinstance(event.message, words.MapRequest):
            return self._tell_judge(event.message)
        effects = self._carry_out(self.agent.handle(event, now), now)
        if isinstance(event.message, Joined) and self.agent.mapping is not None:
            self.sharing.begin(event.message, self.agent.mapping, self.life == 0)
            self._note_unplaced()
        return effects

    def tick(self, now: float) -> list[Effect]:
        """Do what is due: share, draw, decide."""
        self.now = now
        effects: list[Effect] = []
        deadline = self.agent.next_deadline()
        if deadline is not None and deadline <= now:
            effects += self._carry_out(self.agent.tick(now), now)
        effects += self.sharing.tick(now)
        delta = self.sharing.delta_due(now)
        if delta is not None:
            effects += self._tell(delta, now)
        was_tied = self.sharing.tied
        placed = self.sharing.place_due(self._teammates(now), now)
        if self.sharing.tied and not was_tied:
            effects.append(Note("info", f"knows where it is at {now:.1f} s"))
        turned = self.sharing.turned()
        effects += [] if turned is None else self._tell(turned, now)
        effects += [] if placed is None else self._tell(placed, now)
        self.choosing.lost = not self.sharing.tied
        return [*effects, *self._decide(now)]

    def keep(self) -> bytes:
        """Return what the robot writes down for its next start."""
        where = self.agent.pose_map() if self.sharing.tied else None
        return Memory(self.sharing.sync.log, where).pack()

    # --- what the robot's software would tell a server ------------------------------------------

    def _carry_out(self, effects: list[Effect], now: float) -> list[Effect]:
        """Answer what is for a server; all else is to be done as it is."""
        done: list[Effect] = []
        for effect in effects:
            if not (isinstance(effect, Send) and effect.to == SERVER):
                done.append(effect)
            elif answer := self._answers.get(type(effect.message)):
                done += answer(effect.message, now)
        return done

    def _tell(self, message: Message, now: float) -> list[Effect]:
        """Let the robot's software hear a word as if a server had sent it."""
        header = Header(message.type, SERVER, self.name, 0, now)
        return self._carry_out(self.agent.handle(Received("radio", header, message), now), now)

    def _hello(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Hello)
        return self._tell(words.Welcome(now_s=now, strategy="decides for itself"), now)

    def _heartbeat(self, message: Message, now: float) -> list[Effect]:
        """Tell the others where the robot is, and see how long nothing was left to do."""
        assert isinstance(message, words.Heartbeat)
        about = self.sharing.place.whereabouts
        body = (self.sharing.sync.log.me.life, self.agent.body.radius_m, about.sigma[0])
        held, where = self.sharing.checksum(), about.T_map_own @ message.T_odom_base
        if self.sharing.tied:
            where = self.agent.pose_map()
        beacon = self._beaconing.due(message, where, self.choosing, body, held, now)
        effects = self._say_whom_it_saw(now)
        self._note_unplaced()
        if beacon is None:
            return effects
        self.choosing.crew.hear(self.name, beacon, now, now)
        poses = self._tell(self.choosing.team_poses(now), now)
        return [*effects, Send("radio", EVERYONE, beacon), *poses]

    def _say_whom_it_saw(self, now: float) -> list[Effect]:
        """Tell the others whom the robot saw from its start, and what, while somebody needs it."""
        if not self.choosing.crew.seeking:
            return []
        self.sharing.sync.telling.hurry(now)
        lookout = self.sharing.place.lookout_due(now)
        return [Send("radio", EVERYONE, lookout)] if lookout else []

    def _note_unplaced(self) -> None:
        """Let the robot's software know which teammates may be anywhere: at first, all."""
        crew, place = self.choosing.crew, self.sharing.place
        unsure = not self.sharing.tied or (place.uncertain and len(crew.beacons) < _SEVERAL)
        self.agent.unplaced = (self.agent.body.radius_m,) if unsure else crew.unplaced

    def _teammates(self, now: float) -> list[Standing]:
        """Return where those are that were just heard and know their place."""
        bodies = self.choosing.crew.bodies(now - _JUST_NOW)
        return [Standing(*body) for name, *body in bodies if name != self.name]

    def _report(self, message: Message, now: float) -> list[Effect]:
        """Share what the robot saw."""
        assert isinstance(message, words.ScanReport)
        self.sharing.observe(message, now)
        return self._tell(words.ReportsReceived(number=message.number), now)

    def _bid(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Bid)
        award = self.choosing.bid(message, now)
        return self._tell(award, now) if award else []

    def _task_progress(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.TaskProgress)
        self.choosing.progress(message, now)
        return []

    def _task_end(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.TaskEnd)
        award = self.choosing.ended(message, now)
        return self._tell(award, now) if award else []

    def _tight_place(self, message: Message, now: float) -> list[Effect]:
        """Tell the others where the body does not fit through, if it knows where that is."""
        return [Send("radio", EVERYONE, message)] if self.sharing.tied else []

    def _map_request(self, message: Message, now: float) -> list[Effect]:
        return self._tell(self.sharing.feed.snapshot(), now)

    # --- what others say ------------------------------------------------------------------------

    def _hear(self, header: Header, message: Message, now: float) -> list[Effect]:
        """Take a teammate's word."""
        source = header.source
        if not self.sharing.hears(source, now):
            self.choosing.crew.forget(source)
            self.sharing.place.lookouts.forget(source)
            return []
        if isinstance(message, _LOG):
            return self.sharing.take(source, message, now)
        if isinstance(message, Beacon):
            newer, award = self.choosing.hear(source, message, header.stamp, now)
            effects = self._tell(self.choosing.team_poses(now), now) if newer else []
            left = self.choosing.crew.last_heard(source)
            effects += [Send("radio", source, left)] if newer and left else []
            return effects + (self._tell(award, now) if award else [])
        elif isinstance(message, Lookout):
            self.sharing.place.lookouts.hear(source, message)
        elif isinstance(message, LastHeard):
            self.sharing.place.hear(message)
        elif isinstance(message, words.TightPlace) and self.sharing.tied:
            return self._tell(message, now)
        return []

    def _tell_judge(self, request: words.MapRequest) -> list[Effect]:
        """Tell the world's judge how the map looks, by no radio: it is not part of the mission."""
        effects: list[Effect] = [Send("body", WORLD, self.choosing.crew.team_poses())]
        told = self.sharing.told_judge(request.have)
        return effects if told is None else [*effects, Send("body", WORLD, told)]

    # --- deciding -------------------------------------------------------------------------------

    def _decide(self, now: float) -> list[Effect]:
        """Drive home when nothing is left to do; say so when that is so for all that are heard."""
        effects: list[Effect] = []
        overdue = self.choosing.overdue(now)
        if overdue is not None:
            effects += self._tell(words.Terminate(task=overdue.task), now)
            effects += self._task_end(overdue, now)
        award = self.choosing.idle_word(now, self.sharing.home)
        effects += self._tell(award, now) if award else []
        held = self.sharing.checksum()
        self.choosing.agree(held, now)
        through = self.choosing.through
        if not (through or self._said.through):
            return effects
        shut_out = tuple(sorted(self.sharing.sync.standing.isolated))
        word = Through(through=through, held=held, shut_out=shut_out)
        if word == self._said:
            return effects
        if through != self._said.through:
            text = f"through at {now:.1f} s: nothing useful is left, and all hold the same"
            effects.append(Note("info", text if through else f"goes on at {now:.1f} s"))
        self._said = word
        return [*effects, Send("body", WORLD, word)]
